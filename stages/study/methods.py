"""What a finished run knows of the joints, by every method that is compared with an IMU or with motion capture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models import load_rectifier
from ...models.gravity import Seen, level_moving, level_static
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import R_CAMERA_FROM_UPRIGHT
from ...pipeline.core.pose import Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.core.take import Take
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.signals.filters import breaks


def methods(run: Take, rectifiers: Sequence[Rectifier] = ()) -> dict[str, np.ndarray]:
    """Joints (T, 17, 3) by method, relative to the pelvis, each with its own idea of up as +z.

    "camera axes": as if the camera were level. "geometric" and the run's own method: rotated as a take; with "per
    frame", each frame upright by its own vote on up, as without the take. Its heading stays the take's, so that only
    tilt tells them apart. The run's own comes last. rectifiers: further ones, as `each_frame` has them.
    """
    poses, rectified = run.need("poses"), run.need("rectified")
    if rectified.in_world:
        each_frame(run, rectifiers)
        return {"source's own up": rectified.level.joints.astype(np.float64)}
    source = poses.joints.astype(np.float64)
    R_geometric, unknown = load_rectifier("geometric").rotation(source)
    seen = Seen(source, R_geometric, unknown, poses.times, breaks(poses))
    levelled = level_moving(seen) if rectified.camera == "moving" else level_static(seen)
    ways = {
        "geometric": (levelled.R_camera_from_level, R_geometric[..., 2]),
        method_name(rectified): (rectified.R_source_from_level, rectified.up_votes),
    }
    result = {"camera axes": rotate(transpose(R_CAMERA_FROM_UPRIGHT), source), **each_frame(run, rectifiers)}
    for name, (R_source_from_level, votes) in ways.items():
        level = rotate(transpose(R_source_from_level), source)
        own_up = rotate(transpose(R_source_from_level), votes[:, None])[:, 0]
        result |= {f"{name} per frame": rotate(_upright(own_up), level), name: level}
    return result


def each_frame(run: Take, rectifiers: Sequence[Rectifier]) -> dict[str, np.ndarray]:
    """Joints (T, 17, 3) by method, turned frame by frame into the axes that each rectifier answers in: BODY, or its
    data set's own as the 3DPCNet paper has it, with everybody facing -x. InputError for a run that had a world's axes
    from the start."""
    poses = run.need("poses")
    if rectifiers and run.need("rectified").in_world:
        raise InputError(
            "option-conflict",
            f"The poses of {run.name} know their own up ({poses.frame}), so no rectifier can be tried; leave "
            "--rectifier out.",
        )
    source = poses.joints.astype(np.float64)
    return {
        f"{rectifier.method} per frame": rotate(transpose(rectifier.rotation(source)[0]), source)
        for rectifier in rectifiers
    }


def method_name(rectified: Rectified) -> str:
    """The rectifier's name without its hash."""
    return rectified.method.partition("@")[0]


def _upright(up: np.ndarray) -> np.ndarray:
    """(T, 3, 3) the least rotations that turn directions up (T, 3) to +z; NaN for NaN."""
    from scipy.spatial.transform import Rotation

    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(sine, up[:, 2:])
    rows = is_finite(up)
    R = np.full((len(up), 3, 3), np.nan)
    R[rows] = Rotation.from_rotvec((axis * angle / np.maximum(sine, 1e-12))[rows]).as_matrix()
    return R
