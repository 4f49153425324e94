"""FreeMoCap's bodies: `mediapipe_body_3d_xyz.npy`, `mediaPipeSkel_3d_body_hands_face.npy`, and of version 2
`rtmpose_body_3d_xyz.npy` and the tables beside them (formats.md sections 7 and 15).

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

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Z_UP
from ..pipeline.core.layouts import BLAZEPOSE33, COCO23, Layout, remap
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import load
from .kit.beginning import first_bytes
from .kit.landmarks import spelled
from .kit.numpy import peek
from .kit.tables import opened_table
from .kit.world import check_upright

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
_MOST_FRAMES = 10_000_000  # more than a recording has, and as many as fit the memory
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
    poses = _of_table(path) if _is_table(path) else _poses(load(path, *_SHAPES))
    found = poses.joints[np.isfinite(poses.joints).all(axis=(1, 2))]
    if len(found) and (np.ptp(found, axis=1).max(axis=0) == 0).any():
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
    try:
        check_upright(poses, str(path))
    except InputError:
        raise InputError(
            "wrong-axes",
            f"{path}: expected a person who stands along z, as FreeMoCap aligns its skeletons, got one who does not; "
            "run FreeMoCap's alignment or ground plane, or describe the array with --adapter arrays.",
        ) from None
    return (poses,)


def _poses(joints: np.ndarray) -> PoseSequence:
    layout = COCO23 if joints.shape[1] == len(COCO23) else BLAZEPOSE33
    return PoseSequence(joints=joints[:, : len(layout)], layout=layout, frame=Z_UP.with_(unit="mm"))


def _is_table(path: Path) -> bool:
    """Whether a text's first two lines are a table of points and one of a body's points, or of any that names its
    model."""
    lines = first_bytes(path, 4096).decode("utf-8-sig", errors="replace").splitlines()
    if len(lines) < 2:
        return False
    columns, first = lines[0].split(","), lines[1].split(",")
    if not set(_COLUMNS) <= set(columns) or len(first) != len(columns):
        return False
    return "model" in columns or first[columns.index("keypoint")] in _JOINTS


def _of_table(path: Path) -> PoseSequence:
    points: dict[str, dict[int, tuple[float, ...]]] = {}
    for frame, joint, place in _rows(path):
        points.setdefault(joint, {})[frame] = place
    layout = _layout(set(points), path)
    numbers = sorted({frame for places in points.values() for frame in places})
    rows = {frame: row for row, frame in enumerate(numbers)}
    joints = np.full((len(numbers), len(layout), 3), np.nan)
    for i, joint in enumerate(layout.joints):
        for frame, place in points[joint].items():
            joints[rows[frame], i] = place
    return PoseSequence(
        joints=joints, layout=layout, frame=Z_UP.with_(unit="mm"), frame_index=np.array(numbers)
    )


def _layout(joints: set[str], path: Path) -> Layout:
    fits = (layout for layout in (COCO23, BLAZEPOSE33) if set(layout.joints) <= joints)
    if (layout := next(fits, None)) is None:
        raise InputError(
            "wrong-content",
            f"{path}: expected the points of a body, RTMPose's {len(COCO23)} or MediaPipe's {len(BLAZEPOSE33)}, got "
            f"{', '.join(sorted(joints)) or 'none of them'}.",
        )
    return layout


def _rows(path: Path) -> Iterator[tuple[int, str, tuple[float, ...]]]:
    """Frame, joint and place of each row of a body's own trajectory; an empty cell is NaN."""
    with opened_table(path, "FreeMoCap's table") as file:
        for line, row in enumerate(csv.DictReader(file), 2):
            wanted = row.get("model") in (None, *_BODY_MODELS) and row.get("trajectory") in (None, "3d_xyz")
            joint = _JOINTS.get(row["keypoint"] or "") if wanted else None
            if joint is None:
                continue
            try:
                frame, place = int(row["frame"]), tuple(float(row[axis] or "nan") for axis in "xyz")
            except (TypeError, ValueError):
                frame, place = -1, ()
            if not 0 <= frame < _MOST_FRAMES or np.isinf(place).any():
                raise InputError(
                    "wrong-content",
                    f"{path}, line {line}: expected a frame's number and x, y, z, got {row!r:.100}.",
                )
            yield frame, joint, place


def _in_millimetres(poses: PoseSequence) -> bool:
    return bool(_STATURE_MM[0] < implied_stature(remap(poses).joints) < _STATURE_MM[1])
