"""Arrays (frames, 17, 3) of lifters trained on Human3.6M: whose they can be, and what those in metres have in common.

The arrays of several look alike, so one judgement tells all their adapters (`fits`):
- MotionBERT's first pelvis of a clip is at depth 0 alone, or with `rootrel` every pelvis is exactly at the origin; its
  units are those of the crop, or pixels;
- DDHPose and its kin force every pelvis to the origin, in metres, or save clips of 243 frames;
- VideoPose3D and its kin have the pelvis near the origin, in metres;
- anything else of that shape is nobody's, and may be read for what its body shows (adapter arrays).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import PoseSequence
from ...pipeline.files.arrays import peek

FRAMES: tuple[str, int, int] = ("frames", len(H36M17), 3)
CLIP = 243  # frames that MotionBERT, DDHPose and MixSTE see at once
_POSE = FRAMES[1:]
CLIPS = (
    ("clips", CLIP, *_POSE),
    ("clips", "steps", "proposals", CLIP, *_POSE),
    ("steps", "proposals", *FRAMES),
)

_STATURE_M = (1.0, 2.5)
_ROOT_M = 0.1  # a pelvis that a network places at the origin without being forced to is off by less
# Normalised coordinates stay within about 1.5 of the crop's centre, or 2 of the pelvis; pixels are tens to thousands.
_PIXELS_FROM = 10.0


def fits(path: Path) -> frozenset[str]:
    """The adapters whose files begin as this .npy does. Never raises."""
    if (clips := peek(path, *CLIPS)) is not None:
        return frozenset({"ddhpose"} if looks_metric(clips.reshape(-1, *_POSE)) else ())
    joints = peek(path, FRAMES)
    return frozenset() if joints is None else lifters_of(joints)


def lifters_of(joints: np.ndarray) -> frozenset[str]:
    """The adapters whose .npy begins with these joints (T, 17, 3); "arrays" where they are no known lifter's."""
    scores = joints[..., 2][np.isfinite(joints[..., 2])]
    if len(scores) and scores.min() >= 0 and scores.max() <= 1 and in_pixels(joints):  # of places in an image
        return frozenset()
    root = joints[:, H36M17.index("pelvis")]
    if root[0, 2] == 0 and root[0, :2].any():
        return frozenset({"motionbert"})
    if np.nan_to_num(joints).any() and ((root == 0) | np.isnan(root)).all() and not in_pixels(joints):
        return frozenset({"motionbert", "ddhpose", "videopose3d"} if looks_metric(joints) else {"motionbert"})
    return frozenset({"videopose3d"} if looks_metric(joints) else {"arrays"})


def in_camera(joints: np.ndarray, clip: int | None = None, **said: Any) -> PoseSequence:
    """Joints (T, 17, 3) of H36M17 in CAMERA axes, metres. clip: frames of a lifter that works clip by clip, for the
    seams between them. said: further fields of the sequence, or another `frame`. InputError for a clip of no frames."""
    if clip is not None and clip < 1:
        raise InputError("bad-value", f"Expected a clip of at least 1 frame, got {clip}.")
    seams = tuple(range(clip, len(joints), clip)) if clip else ()
    return PoseSequence(joints, H36M17, **{"frame": CAMERA.with_(origin="camera"), "seams": seams, **said})


def in_pixels(joints: np.ndarray) -> bool:
    """Whether joints (T, 17, 3) are pixels, by the largest coordinate of the usual frame: wild frames do not decide."""
    return bool(np.median(np.nanmax(np.abs(joints), axis=(1, 2), initial=0)) > _PIXELS_FROM)


def check_metric(path: Path, joints: np.ndarray, trajectory: bool = False) -> None:
    """InputError unless joints (T, 17, 3) can be what such a lifter saves: metres in camera axes.

    The pelvis is at the origin or, where `trajectory` allows it, the body is in front of the camera. After the
    display rotation of these projects (camera_to_world, heights rebased to the lowest joint) it is neither:
    that frame assumes the tilt of one Human3.6M camera (formats.md 2).
    """
    stature = stature_of(joints)
    if not _human_size(stature):
        raise InputError(
            "wrong-axes",
            f"{path}: expected a body in metres, got one of {stature:.4g}; name the "
            "adapter that fits, or describe the array's unit with --adapter arrays.",
        )
    offset = _root_offset(joints)
    in_front = trajectory and not (joints[..., 2] <= 0).any()
    if offset >= _ROOT_M and not in_front:
        raise InputError(
            "wrong-axes",
            f"{path}: expected camera axes with the pelvis at the origin{' or in front of the camera' * trajectory}, "
            f"got a pelvis {offset:.2g} off; files made for display (D3DP's *_postprocess.npy, heights "
            "rebased to 0) cannot be used: give the raw output, or name the adapter that fits.",
        )


def looks_metric(joints: np.ndarray) -> bool:
    """Whether joints (T, 17, 3) are bodies of human size in metres with the pelvis at the origin."""
    # These lifters force the whole pelvis to 0 or nothing of it; MotionBERT forces the depth alone.
    forced = joints[0, H36M17.index("pelvis")] == 0
    all_or_none = bool(forced.all() or not forced.any())
    return all_or_none and _human_size(stature_of(joints)) and _root_offset(joints) < _ROOT_M


def _human_size(stature: float) -> bool:
    """NaN, from a file without a single body in it, passes: the reader has a clearer word for that."""
    return not (stature < _STATURE_M[0] or stature > _STATURE_M[1])


def stature_of(joints: np.ndarray) -> float:
    """`implied_stature` of joints (T, 17, 3), less failed frames that are filled with zeros."""
    return implied_stature(joints[np.nanmax(np.abs(joints), axis=(1, 2), initial=0) > 0].astype(np.float64))


def _root_offset(joints: np.ndarray) -> float:
    """Distance of the pelvis from the origin, median over the frames that have one."""
    offset = np.linalg.norm(joints[:, H36M17.index("pelvis")], axis=-1)
    offset = offset[np.isfinite(offset)]
    return float(np.median(offset)) if len(offset) else 0.0
