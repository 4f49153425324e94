"""What MMPose 1.x writes of 3D: keypoints of x, y, z beside their scores, the bbox maybe in one more list, or missing
(formats.md 3 and 4)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import Frame
from ...pipeline.core.layouts import Layout
from ...pipeline.core.notices import notice
from ...pipeline.core.pose import PoseSequence
from .clock import Moments
from .frames import first_person, people
from .json import field, numbers
from .people import People

_REBASED = 0.95  # share of bodies whose lowest joint is at height 0
_IMAGE_AXES = (0, 2)  # left and up


def recognised(path: Path, count: int) -> bool:
    """Whether the first person in the file has `count` keypoints of three numbers, and is no detection in a list."""
    found = first_person(path)
    keypoints = found[0].get("keypoints") if found and not found[1] and "image_id" not in found[0] else None
    return (
        isinstance(keypoints, list)
        and len(keypoints) == count
        and all(isinstance(point, list) and len(point) == 3 for point in keypoints)
    )


def read_poses(path: Path, what: str, count: int, layout: Layout, axes: Frame) -> tuple[PoseSequence, ...]:
    """Everybody in the file, joined from frame to frame by their boxes; of `count` keypoints the first ones, which are
    those of the layout. Where each frame's lowest joint was put at height (third axis) 0, a notice says so.

    what: the file in words. InputError when the file is not of this form, is 2D, or has another number of keypoints.
    """
    moments, found = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, what, moments):
        joints = numbers(field(person, "keypoints", where), where)
        scores = numbers(field(person, "keypoint_scores", where), where)
        if joints.ndim == 2 and joints.shape[1] == 2:
            raise InputError(
                "format-unknown",
                f"{where}: expected 3D keypoints, got two coordinates each; adapter json2d reads 2D results.",
            )
        if joints.shape != (count, 3) or scores.shape != (count,):
            raise InputError(
                "wrong-content",
                f"{where}: expected x, y, z and score of {count} joints, got shapes {joints.shape} and {scores.shape}; "
                "adapter mmpose3d reads 17 of them (lifters), adapter rtmw3d 133 (RTMW3D).",
            )
        box = numbers(person.get("bbox", []), where).ravel()
        found.add(moment, joints, scores, box=box if box.shape == (4,) else None)
    return tuple(map(_rebase_said, found.poses(layout, axes, moments.clock(), _IMAGE_AXES)))


def _rebase_said(poses: PoseSequence) -> PoseSequence:
    heights = poses.joints[..., 2]
    rebased = int((np.fmin.reduce(heights, axis=1) == 0).sum())
    if rebased < _REBASED * len(poses):
        return poses
    lowest = np.argmax(heights == 0, axis=1)
    changes = int((np.diff(lowest) != 0).sum())
    said = notice("rebased-to-floor", rebased=rebased, frames=len(poses), changes=changes)
    return poses.noted("rebase", frames=rebased).saying(said)
