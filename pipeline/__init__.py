"""The ground floor: what flows through pcnet3d and how it runs. Costs numpy and scipy to import."""

from .errors import InputError
from .frames import BODY, CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame, change_frame
from .layouts import H36M17, Layout, remap
from .pose import PoseSequence, Rectified
from .rotations import rotate
from .running.recipe import load_recipe
from .running.runner import Pipeline
from .take import Event, Take, Video

__all__ = [
    "BODY", "CAMERA", "H36M17", "IMAGE", "LEVEL", "Y_UP", "Z_UP",
    "Event", "Frame", "InputError", "Layout", "Pipeline", "PoseSequence", "Rectified", "Take", "Video",
    "change_frame", "load_recipe", "remap", "rotate",
]  # fmt: skip
