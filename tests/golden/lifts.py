"""The built-in lifter on keypoints alone."""

from pathlib import Path

from pcnet3d.models.lifter.builtin import lifted
from pcnet3d.pipeline import PoseSequence
from pcnet3d.pipeline.core.lifted import ToLift


def lift(keypoints: PoseSequence, *asked, model: str | Path = "pcnet3d", **more) -> PoseSequence:
    """The poses with their history. asked, more: further fields of ToLift."""
    return lifted(ToLift(keypoints, *asked, **more), model).noted()
