"""Kinematics that mean the same thing from every camera: the names that most need, each loaded when it is asked for.

Everything else is in the parts: `pcnet3d.pipeline`, `.adapters`, `.models` and `.stages`.
"""

from typing import TYPE_CHECKING, Any

from .pipeline.core.faces import lazily

if TYPE_CHECKING:
    from . import adapters, models, pipeline, stages
    from .pipeline.core.errors import InputError
    from .pipeline.core.frames import BODY, CAMERA, GL_CAMERA, IMAGE, LEVEL, Y_UP, Z_UP, Frame
    from .pipeline.core.layouts import (
        BLAZEPOSE33,
        BODY_25,
        BODY_25B,
        COCO17,
        COCO18,
        COCO23,
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
    from .pipeline.core.pose import MadeBy, PoseSequence, Rectified
    from .pipeline.core.take import Take
    from .pipeline.files.finished import read_run
    from .pipeline.reading.load import read
    from .pipeline.running.run import process
    from .stages.rectify import rectify

    __version__: str

__all__ = [
    "BLAZEPOSE33", "BODY", "BODY_25", "BODY_25B", "CAMERA", "COCO17", "COCO18", "COCO23", "GL_CAMERA", "H36M17",
    "H36M17_B", "H36M17_C", "HALPE26", "IMAGE", "LEVEL", "MHR70", "MPI3DHP17", "OPENPOSE18", "SOMA30", "SOMA77", "Y_UP",
    "Z_UP", "Frame", "InputError", "Layout", "MadeBy", "PoseSequence", "Rectified", "Take", "__version__", "adapters",
    "models", "pipeline", "process", "read", "read_run", "rectify", "stages",
]  # fmt: skip

_named, __dir__ = lazily(__name__)


def __getattr__(name: str) -> Any:
    """`__version__` when it is asked for: most who import a part never do."""
    if name == "__version__":
        from .pipeline.core.pose import package_version

        return package_version()
    if name not in __all__:
        from .pipeline.plugins.removed import refuse_removed

        refuse_removed("names", name)
    return _named(name)
