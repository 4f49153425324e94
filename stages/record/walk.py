"""The person in LEVEL where they are in the room: their path over the floor, and the camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import breaks, runs
from ..drawing.palette import MIDDLE
from ..drawing.rerun_log import person_view

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_PATH, _CAMERA = (215, 215, 215), MIDDLE
# Where the eye stands, from the middle of the scene and in its reach: along LEVEL's axes; or along the camera's view,
# to the side that the person faces, and up.
_EYE, _BESIDE_CAMERA = (-1.6, 1.3, 0.7), (-0.55, 2.1, 1.05)


def walked(rectified: Rectified) -> PoseSequence | None:
    """LEVEL with every joint in the room, from the camera or the world's origin; None where that is not known."""
    level = rectified.level
    if level.root is None or not is_finite(level.root).any():
        return None
    root = level.root[:, None]
    return level.with_(joints=level.joints + root, path=None)


def log_room(recording: rr.RecordingStream, take: Take, size: float) -> None:
    """What the person walks through: walk/path, the pelvis path on the floor; and walk/camera, the camera at its
    place."""
    import rerun as rr

    rectified = take.need("rectified")
    level = rectified.level
    if walked(rectified) is None or level.path is None:
        return
    path = np.column_stack([level.path.points[:, :2], np.full(len(level), ground(rectified, size))])
    strips = [path[piece] for piece in runs(is_finite(level.path.points), level.times, breaks(level))]
    look = rr.LineStrips3D(strips, colors=[_PATH], radii=[0.012 * size])
    recording.log("walk/path", look, static=True)
    R_level_from_camera = _camera_axes(take)
    if take.camera is not None and R_level_from_camera is not None:
        width, height = take.camera.image_size
        place = rr.Transform3D(translation=[0, 0, 0], mat3x3=R_level_from_camera)
        lens = rr.Pinhole(
            focal_length=take.camera.focal_px,
            width=width,
            height=height,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.6 * size,
            color=_CAMERA,
        )
        recording.log("walk/camera", place, lens, static=True)


def _camera_axes(take: Take) -> np.ndarray | None:
    """(3, 3) R_level_from_camera of a camera that stands still, whose centre is then LEVEL's origin; None where the
    path is counted from elsewhere."""
    source, rectified = take.need("poses").frame, take.need("rectified")
    if source.family != "camera" or rectified.R_source_from_level.ndim == 3:
        return None
    return rectified.R_source_from_level.T @ source.basis


def camera_sides(take: Take) -> tuple[np.ndarray, np.ndarray] | None:
    """(2,) unit, where a camera that stands still looks over the floor of LEVEL, and beside it the side from which
    people come towards the eye, as they face -x; None as `_camera_axes`, and where it looks straight up or down."""
    R_level_from_camera = _camera_axes(take)
    ahead = np.zeros(2) if R_level_from_camera is None else R_level_from_camera[:2, 2]
    length = np.linalg.norm(ahead)
    if length < 1e-6:
        return None
    x, y = ahead / length
    return np.array([x, y]), np.array([-y, x] if y > 0 else [y, -x])


def walk_view(take: Take, placed: PoseSequence, size: float) -> rrb.View:
    """All of the path at once, and the camera too. size: about half the person's height."""
    low, high = (np.nanpercentile(placed.without_feet.joints, share, axis=(0, 1)) for share in (1, 99))
    eye = np.array(_EYE)
    if (sides := camera_sides(take)) is not None:
        low, high = np.minimum(low, 0), np.maximum(high, 0)
        *over_floor, up = _BESIDE_CAMERA
        eye = np.append(over_floor @ np.stack(sides), up)
    reach = max(size, 0.45 * float(np.linalg.norm(high - low)))
    middle = (low + high) / 2
    return person_view(
        "walk",
        "All of the path: LEVEL",
        middle + reach * eye,
        middle,
        contents=["+ /walk/**", "+ /level/**"],
    )


def ground(rectified: Rectified, size: float) -> float:
    """Height of the floor in LEVEL; half the person's height, `size`, under the pelvis where no foot is ever seen."""
    level = rectified.level
    height = floor_height(level)
    if np.isfinite(height):
        return height
    return (
        -size
        if walked(rectified) is None or level.root is None
        else float(np.nanmedian(level.root[:, 2])) - size
    )
