"""What MMPose 1.x writes of 3D: keypoints of x, y, z beside their scores, the bbox maybe in one more list, or missing.

Of 17 joints it is a lifter's, JSON of Pose3DInferencer, also a folder of one an image, or of
body3d_pose_lifter_demo.py. What was done to the lifter's output before it was written is in formats.md 3. The
reflection is undone by the words of the frame here. The unit depends on the lifter, which the file does not name.
Scores are 1 throughout and therefore unknown.

Of 133, COCO-WholeBody's, it is RTMW3D's demo (formats.md 4), of which the 17 joints of COCO and the heels and toes, the
first 23, are used. Depth is metric and the image's plane is not: its scale is the one that gives the body the stature
of option stature_m, one for the whole take. A crop that changes its size breaks that; such poses are not to be trusted
in metres.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.anthropometry import STATURES_M, implied_stature
from ..pipeline.core.conversions import remap
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Frame
from ..pipeline.core.layouts import COCO23, H36M17
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.clock import Moments
from .kit.json import field, first_person, numbers, people
from .kit.people import People

name = "mmpose3d"
gives = "poses"
made_by = MadeBy("estimated", "MMPose")
reads = (
    "3D JSON of MMPose 1.x: lifters, inferencer or demo, no known scale (with option metric: metres); RTMW3D's demo, "
    "metres by a stature that is assumed (option stature_m)"
)

_LIFTED = Frame("MMPOSE3D", "camera", ("left", "away", "up"), origin="lowest joint")
_RTMW3D = Frame("RTMW3D", "camera", ("left", "toward", "up"), origin="crop")
_COUNTS = (len(H36M17), 133)
_BIN_M = 2.1744869 / 144
_STATURE_M = 1.7
_REBASED = 0.95  # share of bodies whose lowest joint is at height 0
_IMAGE_AXES = (0, 2)  # left and up


def sniff(path: Path) -> bool:
    """Whether the first person in the file has so many keypoints of three numbers, and is no detection in a list."""
    first = first_person(path)
    keypoints = first[0].get("keypoints") if first and not first[1] and "image_id" not in first[0] else None
    return (
        isinstance(keypoints, list)
        and len(keypoints) in _COUNTS
        and all(isinstance(point, list) and len(point) == 3 for point in keypoints)
    )


def read(path: Path, metric: bool = False, stature_m: float | None = None) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by their boxes: H36M17 in MMPose's mirrored axes, or COCO23,
    left, toward the camera, up, metres.

    metric: the lifter was one that gives metres (SimpleBaseline, VideoPose3D), so the unit is "m". stature_m: of
    everybody in RTMW3D's file, 1.7 without it; it sets the scale of the image's plane. frame_index counts from 0, for a
    folder as its names do; a frame without people has no row. RTMW3D's scores are maxima of bins, no probabilities, and
    those above 1 are clipped. Heights that were shifted frame by frame are found and said in the history. InputError
    when the file is not of this form, or is 2D, for an option of the other kind of file, and where RTMW3D's depth alone
    is more than the body is tall.
    """
    moments, sightings = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "MMPose's 3D results", moments):
        joints = numbers(field(person, "keypoints", where), where)
        scores = numbers(field(person, "keypoint_scores", where), where)
        if joints.ndim == 2 and joints.shape[1] == 2:
            raise InputError(
                "format-unknown",
                f"{where}: expected 3D keypoints, got two coordinates each; adapter json2d reads 2D results.",
            )
        if joints.shape[1:] != (3,) or len(joints) not in _COUNTS or scores.shape != joints.shape[:1]:
            raise InputError(
                "wrong-content",
                f"{where}: expected x, y, z and score of 17 joints (lifters) or 133 (RTMW3D), got shapes "
                f"{joints.shape} and {scores.shape}.",
            )
        box = numbers(person.get("bbox", []), where).ravel()
        sightings.add(moment, joints, scores, box=box if box.shape == (4,) else None)
    whole_body = sightings.points.shape[1] != len(H36M17)
    if metric if whole_body else stature_m is not None:
        option, kind = ("metric", "a lifter") if whole_body else ("stature_m", "RTMW3D")
        raise InputError(
            "option-conflict",
            f"{path}: option {option} is for results of {kind}, which these are not; leave it out.",
        )
    layout, axes = (COCO23, _RTMW3D) if whole_body else (H36M17, _LIFTED)
    axes = axes if whole_body else axes.with_(unit="m" if metric else "arbitrary")
    everybody = map(_rebase_noted, sightings.poses(layout, axes, moments.clock(), _IMAGE_AXES))
    return tuple(
        _metric(poses, stature_m or _STATURE_M, path) if whole_body else poses for poses in everybody
    )


def _rebase_noted(poses: PoseSequence) -> PoseSequence:
    """With a notice where each frame's lowest joint was put at height (third axis) 0."""
    heights = poses.joints[..., 2]
    rebased = int((np.fmin.reduce(heights, axis=1) == 0).sum())
    if rebased < _REBASED * len(poses):
        return poses
    lowest = np.argmax(heights == 0, axis=1)
    changes = int((np.diff(lowest) != 0).sum())
    to_floor = notice("rebased-to-floor", rebased=rebased, frames=len(poses), changes=changes)
    return poses.noted("rebase", frames=rebased).saying(to_floor)


def _metric(poses: PoseSequence, stature_m: float, path: Path) -> PoseSequence:
    """RTMW3D's in metres."""
    from scipy.optimize import brentq

    if not STATURES_M[0] <= stature_m <= STATURES_M[1]:
        raise InputError(
            "bad-value", f"Expected stature_m of {STATURES_M[0]} to {STATURES_M[1]} m, got {stature_m:g}."
        )

    def scaled(per_pixel: float) -> PoseSequence:
        return poses.with_(joints=poses.joints * np.array([per_pixel, _BIN_M, per_pixel]))

    def excess(per_pixel: float) -> float:
        return implied_stature(remap(scaled(per_pixel)).joints) - stature_m

    flat = implied_stature(remap(poses.with_(joints=poses.joints * [1, 0, 1])).joints)
    # Bones are at least as long as in the image, so that the upper end is enough.
    if not flat > 0 or excess(0) >= 0:
        raise InputError(
            "wrong-axes",
            f"{path}: expected RTMW3D's crop pixels and depth bins, got a body that is deeper than tall; is this file "
            "its demo's output?",
        )
    per_pixel: float = brentq(excess, 0, 1.01 * stature_m / flat)  # type: ignore[assignment]  # a number, without full_output
    made = scaled(per_pixel).with_(made_by=MadeBy("estimated", "RTMW3D"))
    return made.noted("scale", metres_per_pixel=per_pixel, stature_m=stature_m)
