"""FreeMoCap's bodies: `mediapipe_body_3d_xyz.npy`, `mediaPipeSkel_3d_body_hands_face.npy` (formats.md section 7).

(frames, 33, 3) in MediaPipe's order, or with hands and face (frames, 553, 3), of which the first 33 are the body.
Millimetres (the charuco square's size was given in them), z up once FreeMoCap has aligned the skeleton or found the
ground; NaN where a gap was not filled. A recording of a single camera is flat unless an option was set: such files are
refused. Frame rate and the first row's video frame are not in the file, and neither is whether it was aligned: a person
who does not stand along z is refused, a slight tilt is not noticed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.anthropometry import implied_stature
from ..pipeline.errors import InputError
from ..pipeline.frames import Z_UP
from ..pipeline.layouts import BLAZEPOSE33, remap
from ..pipeline.pose import PoseSequence
from .kit.numpy import load, peek
from .kit.world import check_upright

name = "freemocap"
gives = "poses"
reads = "FreeMoCap's mediapipe_body_3d_xyz.npy and mediaPipeSkel_3d_body_hands_face.npy: millimetres, z up"

_SHAPES = (("frames", len(BLAZEPOSE33), 3), ("frames", len(BLAZEPOSE33) + 2 * 21 + 478, 3))
_STATURE_MM = (800.0, 2600.0)


def sniff(path: Path) -> bool:
    joints = peek(path, *_SHAPES)
    return joints is not None and not np.isinf(joints).any() and _in_millimetres(_poses(joints))


def read(path: Path) -> tuple[PoseSequence]:
    """The one person of the file: BLAZEPOSE33 in the Z-up world, millimetres.

    InputError when the file is no such array, is flat, is not in millimetres, or the person does not stand along z.
    """
    poses = _poses(load(path, *_SHAPES))
    found = poses.joints[np.isfinite(poses.joints).all(axis=(1, 2))]
    if len(found) and (np.ptp(found, axis=1).max(axis=0) == 0).any():
        raise InputError(
            f"{path}: expected bodies in space, got flat ones, as FreeMoCap writes them from a single camera; lift its "
            "2D detections instead."
        )
    if not _in_millimetres(poses):
        raise InputError(
            f"{path}: expected millimetres, got a body whose limbs imply a stature of "
            f"{implied_stature(remap(poses).joints):.4g}; describe the array with --adapter arrays."
        )
    try:
        check_upright(poses, str(path))
    except InputError:
        raise InputError(
            f"{path}: expected a person who stands along z, as FreeMoCap aligns its skeletons, got one who does not; "
            "run FreeMoCap's alignment or ground plane, or describe the array with --adapter arrays."
        ) from None
    return (poses,)


def _poses(joints: np.ndarray) -> PoseSequence:
    return PoseSequence(joints=joints[:, : len(BLAZEPOSE33)], layout=BLAZEPOSE33, frame=Z_UP.with_(unit="mm"))


def _in_millimetres(poses: PoseSequence) -> bool:
    return bool(_STATURE_MM[0] < implied_stature(remap(poses).joints) < _STATURE_MM[1])
