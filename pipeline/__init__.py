"""The ground floor: what flows through pcnet3d and how it runs. A name costs its imports only when it is asked for."""

from typing import TYPE_CHECKING

from .core.faces import lazily

if TYPE_CHECKING:
    from .core.camera import Camera
    from .core.conversions import change_frame, remap
    from .core.device import computing_on
    from .core.errors import InputError
    from .core.frames import BODY, CAMERA, GL_CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame
    from .core.layouts import (
        BLAZEPOSE33,
        BODY_25,
        BODY_25B,
        COCO17,
        COCO18,
        COCO23,
        FEET,
        H36M17,
        H36M17_B,
        H36M17_C,
        HALPE26,
        MHR70,
        MPI3DHP17,
        OPENPOSE18,
        SOMA30,
        SOMA77,
        Layout,
    )
    from .core.lifted import Lifted, ToLift
    from .core.measures import Measure, nested
    from .core.notices import Notice, notice, own_notice
    from .core.pose import MadeBy, PoseSequence, Rectified, RootPath
    from .core.rotations import angle_deg, rotate, transpose
    from .core.take import Take, Told, Video
    from .files.atomic import whole_file
    from .files.finished import read_run
    from .plugins.protocols import Adapter, Lifter, Rectifier, Stage, Writer
    from .reading.settings import RunOptions
    from .reading.take import open_take
    from .reading.testing import check_adapter
    from .running.recipe import load_recipe, planned
    from .running.run import run_files
    from .running.runner import Pipeline
    from .signals.angles import ANGLES, REASONS, angles
    from .signals.swaps import find_swaps

__all__ = [
    "ANGLES", "BLAZEPOSE33", "BODY", "BODY_25", "BODY_25B", "CAMERA", "COCO17", "COCO18", "COCO23", "FEET", "GL_CAMERA",
    "H36M17", "H36M17_B", "H36M17_C", "HALPE26", "IMAGE", "LEVEL", "MHR70", "MPI3DHP17", "OPENPOSE18",
    "REASONS", "SOMA30", "SOMA77", "Y_UP", "Z_UP", "Adapter", "Camera", "Frame", "InputError", "Layout",
    "Lifted", "Lifter", "MadeBy", "Measure", "Notice", "Pipeline", "PoseSequence", "Rectified", "Rectifier", "RootPath",
    "RunOptions", "Stage", "Take", "ToLift", "Told", "Video", "Writer", "angle_deg", "angles", "change_frame",
    "check_adapter", "computing_on", "find_swaps", "load_recipe", "nested", "notice", "open_take",
    "own_notice", "planned", "read_run", "remap", "rotate", "run_files", "transpose",
    "whole_file",
]  # fmt: skip

__getattr__, __dir__ = lazily(__name__)
