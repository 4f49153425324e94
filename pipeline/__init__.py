"""The ground floor: what flows through pcnet3d and how it runs. A name costs its imports only when it is asked for."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .errors import InputError
    from .frames import BODY, CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame, change_frame
    from .layouts import H36M17, Layout, remap
    from .pose import PoseSequence, Rectified
    from .rotations import rotate
    from .running.recipe import load_recipe
    from .running.runner import Pipeline
    from .take import Event, Take, Video

_HOMES = {
    "errors": ("InputError",),
    "frames": ("BODY", "CAMERA", "IMAGE", "LEVEL", "Y_UP", "Z_UP", "Frame", "change_frame"),
    "layouts": ("H36M17", "Layout", "remap"),
    "pose": ("PoseSequence", "Rectified"),
    "rotations": ("rotate",),
    "running.recipe": ("load_recipe",),
    "running.runner": ("Pipeline",),
    "take": ("Event", "Take", "Video"),
}

__all__ = [
    "BODY", "CAMERA", "H36M17", "IMAGE", "LEVEL", "Y_UP", "Z_UP",
    "Event", "Frame", "InputError", "Layout", "Pipeline", "PoseSequence", "Rectified", "Take", "Video",
    "change_frame", "load_recipe", "remap", "rotate",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    home = next((module for module, names in _HOMES.items() if name in names), None)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{home}", __name__), name)
