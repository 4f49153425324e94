"""The ground floor: what flows through pcnet3d and how it runs. A name costs its imports only when it is asked for."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .core.errors import InputError
    from .core.frames import BODY, CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame, change_frame
    from .core.layouts import H36M17, Layout, remap
    from .core.pose import PoseSequence, Rectified
    from .core.rotations import rotate
    from .core.take import Event, Take, Told, Video
    from .reading.settings import RunOptions
    from .reading.take import open_take
    from .running.plan import planned
    from .running.recipe import load_recipe
    from .running.run import run_files
    from .running.runner import Pipeline

_HOMES = {
    "core.errors": ("InputError",),
    "core.frames": ("BODY", "CAMERA", "IMAGE", "LEVEL", "Y_UP", "Z_UP", "Frame", "change_frame"),
    "core.layouts": ("H36M17", "Layout", "remap"),
    "core.pose": ("PoseSequence", "Rectified"),
    "core.rotations": ("rotate",),
    "reading.settings": ("RunOptions",),
    "reading.take": ("open_take",),
    "running.plan": ("planned",),
    "running.recipe": ("load_recipe",),
    "running.run": ("run_files",),
    "running.runner": ("Pipeline",),
    "core.take": ("Event", "Take", "Told", "Video"),
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
