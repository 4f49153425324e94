"""RTMW3D's results as MMPose's demo writes them: JSON of 133 COCO-WholeBody joints (formats.md 4).

Depth is metric and the image's plane is not: its scale is the one that gives the body the stature of option stature_m,
one for the whole take. A crop that changes its size breaks that; such poses are not to be trusted in metres. The 17
joints of COCO and the heels and toes, the first 23 of the 133, are used.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.anthropometry import STATURES_M, implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Frame
from ..pipeline.core.layouts import COCO23, remap
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.mmpose import read_poses, recognised

name = "rtmw3d"
gives = "poses"
made_by = MadeBy("estimated", "RTMW3D")
reads = "JSON of RTMW3D's demo in MMPose, 133 joints, metres by a stature that is assumed (option stature_m)"
marks = ("frame_id", "instances", "keypoints", "keypoint_scores")

_AXES = Frame("RTMW3D", "camera", ("left", "toward", "up"), origin="crop")
_COUNT = 133
_BIN_M = 2.1744869 / 144


def sniff(path: Path) -> bool:
    return recognised(path, _COUNT)


def read(path: Path, stature_m: float = 1.7) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by their boxes: COCO23, left, toward the camera, up, metres.

    stature_m: of everybody in the file; it sets the scale of the image's plane.
    frame_index counts from 0; scores are maxima of bins, no probabilities, and those above 1 are clipped. Raises
    InputError when the file is not of this form or its depth alone is more than the body is tall.
    """
    if not STATURES_M[0] <= stature_m <= STATURES_M[1]:
        raise InputError(
            "bad-value", f"Expected stature_m of {STATURES_M[0]} to {STATURES_M[1]} m, got {stature_m:g}."
        )
    people = read_poses(path, "RTMW3D's results", _COUNT, COCO23, _AXES)
    return tuple(_metric(poses, stature_m, path) for poses in people)


def _metric(poses: PoseSequence, stature_m: float, path: Path) -> PoseSequence:
    from scipy.optimize import brentq

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
    return scaled(per_pixel).noted("scale", metres_per_pixel=per_pixel, stature_m=stature_m)
