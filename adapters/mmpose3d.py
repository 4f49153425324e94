"""3D results of MMPose 1.x lifters: JSON of Pose3DInferencer, also a folder of one an image, or of
body3d_pose_lifter_demo.py. What was done to the lifter's output before it was written is in formats.md 3.

The reflection is undone by the words of the frame here, and people are joined by their boxes again. The unit depends on
the lifter, which the file does not name. Scores are 1 throughout and therefore unknown.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.frames import Frame
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.mmpose import read_poses, recognised

name = "mmpose3d"
gives = "poses"
made_by = MadeBy("estimated", "MMPose")
reads = "3D JSON of MMPose 1.x lifters, inferencer or demo, no known scale (with option metric: metres)"
marks = ("frame_id", "instances", "keypoints", "keypoint_scores")

_AXES = Frame("MMPOSE3D", "camera", ("left", "away", "up"), origin="lowest joint")


def sniff(path: Path) -> bool:
    return recognised(path, len(H36M17))


def read(path: Path, metric: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by their boxes: H36M17 in MMPose's mirrored axes.

    metric: the lifter was one that gives metres (SimpleBaseline, VideoPose3D), so the unit is "m".
    frame_index counts from 0, for a folder as its names do; a frame without people has no row. Heights that were
    shifted frame by frame are found and said in the history. Raises InputError when the file is not of this form, or
    is 2D.
    """
    axes = _AXES.with_(unit="m" if metric else "arbitrary")
    return read_poses(path, "MMPose's 3D results", len(H36M17), H36M17, axes)
