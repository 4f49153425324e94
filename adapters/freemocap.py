"""FreeMoCap's bodies: `mediapipe_body_3d_xyz.npy`, `mediaPipeSkel_3d_body_hands_face.npy`, and of version 2
`rtmpose_body_3d_xyz.npy` and the tables beside them.

(frames, 33, 3) in MediaPipe's order, or with hands and face (frames, 553, 3), of which the first 33 are the body;
(frames, 23, 3) of RTMPose, body and feet of COCO-WholeBody. A table has a row a point (frame, keypoint, x, y, z) of the
body or, with a model named, of everything; its trajectory 3d_xyz is used, not rigid_3d_xyz, whose bones are forced to
one length.

Millimetres (the charuco square's size was given in them), z up once FreeMoCap has aligned the skeleton or found the
ground; NaN where a gap was not filled. A recording of a single camera is flat unless an option was set: such files are
refused. The frame rate is not in these files, in arrays the first row's video frame neither, and in none whether it was
aligned: a person who does not stand along z is refused, a slight tilt is not noticed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.conversions import remap
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Z_UP
from ..pipeline.core.layouts import BLAZEPOSE33, COCO23
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import peek, plain_array
from .kit.people import People
from .kit.tables import header_of, read_points
from .kit.world import check_upright
from .mediapipe import spelled

name = "freemocap"
gives = "poses"
made_by = MadeBy("estimated", "FreeMoCap")
reads = "FreeMoCap's *_body_3d_xyz.npy and .csv, freemocap_data_by_frame.csv, mediaPipeSkel_...npy: millimetres, z up"

_SHAPES = (
    ("frames", len(BLAZEPOSE33), 3),
    ("frames", len(BLAZEPOSE33) + 2 * 21 + 478, 3),
    ("frames", len(COCO23), 3),
)
_COLUMNS = ("frame", "keypoint", "x", "y", "z")
_BODY_MODELS = ("rtmpose.body", "mediapipe.body", "mediapipe_body")
_STATURE_MM = (800.0, 2600.0)
_JOINTS = {
    spelled(joint): joint for layout in (COCO23, BLAZEPOSE33) for joint in layout.joints
}  # as MediaPipe's


def sniff(path: Path) -> bool:
    if _is_table(path):
        return True
    joints = peek(path, *_SHAPES)
    return joints is not None and not np.isinf(joints).any() and _in_millimetres(_poses(joints))


def read(path: Path) -> tuple[PoseSequence]:
    """The one person of the file: BLAZEPOSE33 or COCO23 in the Z-up world, millimetres.

    InputError when the file is no such array or table, is flat, is not in millimetres, or the person does not stand
    along z.
    """
    poses = _of_table(path) if _is_table(path) else _poses(plain_array(path, *_SHAPES))
    whole = poses.joints[np.isfinite(poses.joints).all(axis=(1, 2))]
    if len(whole) and (np.ptp(whole, axis=1).max(axis=0) == 0).any():
        raise InputError(
            "wrong-content",
            f"{path}: expected bodies in space, got flat ones, as FreeMoCap writes them from a single camera; lift its "
            "2D detections instead.",
        )
    if not _in_millimetres(poses):
        raise InputError(
            "wrong-axes",
            f"{path}: expected millimetres, got a body whose limbs imply a stature of "
            f"{implied_stature(remap(poses).joints):.4g}; describe the array with --adapter arrays.",
        )
    check_upright(
        poses, str(path), "run FreeMoCap's alignment or ground plane, or read it with --adapter arrays"
    )
    return (poses,)


def _poses(joints: np.ndarray) -> PoseSequence:
    layout = COCO23 if joints.shape[1] == len(COCO23) else BLAZEPOSE33
    return PoseSequence(joints=joints[:, : len(layout)], layout=layout, frame=Z_UP.with_(unit="mm"))


def _is_table(path: Path) -> bool:
    """Whether a text is a table of a body's points, or of any that name their model."""
    header = header_of(path)
    if header is None or header.dims != 3 or not set(_COLUMNS) <= set(header.names):
        return False
    return "model" in header.names or bool(header.points & {*_JOINTS})


def _of_table(path: Path) -> PoseSequence:
    table = read_points(path, "FreeMoCap's table", only={"model": _BODY_MODELS, "trajectory": ("3d_xyz",)})
    names = {_JOINTS[point]: i for i, point in enumerate(table.names) if point in _JOINTS}
    layout = next((layout for layout in (COCO23, BLAZEPOSE33) if set(layout.joints) <= names.keys()), None)
    if layout is None:
        raise InputError(
            "wrong-content",
            f"{path}: expected the points of a body, RTMPose's {len(COCO23)} or MediaPipe's {len(BLAZEPOSE33)}, got "
            f"{', '.join(sorted(table.names)) or 'none of them'}.",
        )
    people = People(str(path))
    columns = [names[joint] for joint in layout.joints]
    for moment, values in zip(table.moments.tolist(), table.values[:, columns, :3], strict=True):
        people.add(moment, values, person="0")
    (poses,) = people.poses(layout, Z_UP.with_(unit="mm"), table.clock)
    return poses


def _in_millimetres(poses: PoseSequence) -> bool:
    return bool(_STATURE_MM[0] < implied_stature(remap(poses).joints) < _STATURE_MM[1])
