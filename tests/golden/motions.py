"""Motions of somebody who stands, with angles of a test's own."""

from collections.abc import Mapping, Sequence

import numpy as np

from golden.jumps import standing
from pcnet3d.models.common.motion import Motion
from pcnet3d.pipeline.core.frames import CAMERA, LEVEL, Z_UP
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.pose import MadeBy, PoseSequence, Rectified, RootPath

CAPTURED = MadeBy("measured", "capture")


def motion_with(
    angles: Mapping[str, np.ndarray],
    times: np.ndarray,
    *,
    apart: np.ndarray | None = None,
    moved: np.ndarray | None = None,
    lean_deg: np.ndarray | None = None,
    unknown: Mapping[str, np.ndarray] | None = None,
    seams: Sequence[int] = (),
    made_by: MadeBy = CAPTURED,
) -> Motion:
    """angles: columns (T,) by name, without "_deg" unless they are of errors. apart: (T,) lengths of a leg by which the
    right ankle is ahead. moved: (T, 2) of both feet over the floor, in lengths of a leg. lean_deg: (T,) of the trunk.
    unknown: {joint: (T,)} where it is not known."""
    count = len(times)
    joints = np.tile(standing(), (count, 1, 1)).astype(np.float64)
    joints -= joints[:, :1]
    ankles = H36M17.indices(("r_ankle", "l_ankle"))
    leg = float(np.linalg.norm(joints[0, H36M17.index("r_hip")] - joints[0, ankles[0]]))
    body, root = joints.copy(), np.zeros((count, 3))
    if apart is not None:
        body[:, ankles[0], 0] -= leg * apart  # BODY's x is back
    if moved is not None:
        root[:, :2] = leg * moved
    known = np.ones((count, 17), dtype=bool)
    for joint, rows in (unknown or {}).items():
        known[rows, H36M17.index(joint)] = False
    frame, camera = (Z_UP, None) if made_by.kind == "measured" else (CAMERA, "static")
    filtered = PoseSequence(joints, H36M17, LEVEL, time_s=times, path=RootPath(root))
    eye = np.tile(np.eye(3), (count, 1, 1))
    source = PoseSequence(joints, H36M17, frame, time_s=times, made_by=made_by)
    rectified = Rectified(
        filtered, eye, np.eye(3), np.zeros(count), "geometric", "median", source=frame, camera=camera
    )
    return Motion(
        source=source,
        filtered=filtered,
        rectified=rectified,
        body=body,
        columns={name if name.endswith("_deg") else f"{name}_deg": values for name, values in angles.items()},
        seams=tuple(seams),
        known=known,
        unsure={},
        lean_deg=np.zeros(count) if lean_deg is None else lean_deg,
        against={},
    )
