"""The ground floor: what flows through pcnet3d and how it runs. A name costs its imports only when it is asked for."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import InputError
    from .frames import BODY, CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame, change_frame
    from .layouts import H36M17, Layout, remap
    from .pose import PoseSequence, Rectified
    from .reading.settings import RunOptions
    from .reading.take import open_take
    from .rotations import rotate
    from .running.plan import planned
    from .running.recipe import load_recipe
    from .running.run import run_files
    from .running.runner import Pipeline
    from .take import Event, Take, Told, Video

_HOMES = {
    "errors": ("InputError",),
    "frames": ("BODY", "CAMERA", "IMAGE", "LEVEL", "Y_UP", "Z_UP", "Frame", "change_frame"),
    "layouts": ("H36M17", "Layout", "remap"),
    "pose": ("PoseSequence", "Rectified"),
    "rotations": ("rotate",),
    "reading.settings": ("RunOptions",),
    "reading.take": ("open_take",),
    "running.plan": ("planned",),
    "running.recipe": ("load_recipe",),
    "running.run": ("run_files",),
    "running.runner": ("Pipeline",),
    "take": ("Event", "Take", "Told", "Video"),
}

__all__ = [
    "BODY", "CAMERA", "H36M17", "IMAGE", "LEVEL", "Y_UP", "Z_UP",
    "Event", "Frame", "InputError", "Layout", "Pipeline", "PoseSequence", "Rectified", "RunOptions",
    "Take", "Told", "Video",
    "change_frame", "load_recipe", "open_take", "planned", "remap", "rotate", "run_files",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    home = next((module for module, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{home}", __name__), name)
