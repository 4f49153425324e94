"""Steps of a pipeline: one file each; a stage is also a plain function on a pose sequence."""

from typing import TYPE_CHECKING

from ..pipeline.core.faces import lazily
from .rectify import rectify

if TYPE_CHECKING:
    from .study.live.frames import LivePose, live_frames

__all__ = ["LivePose", "live_frames", "rectify"]

__getattr__, __dir__ = lazily(__name__)
