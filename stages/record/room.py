"""The person in LEVEL where they are in the room: the floor, their path over it, the camera; and the views of these, of
which the first goes along with the person."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.pose import Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import breaks, on_lines, runs
from ..drawing.palette import MIDDLE
from ..drawing.rerun_log import person_view, time_columns

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_PATH, _FLOOR, _CAMERA = (215, 215, 215), (70, 70, 70), MIDDLE
_MOST_LINES, _AROUND = 60, 2.5  # lines of the floor to each side; its margin, in sizes of the person
# Where the eye stands: along the camera's view, to the side that the person faces, and up. In sizes of the person from
# who is followed, and in the reach of the whole path from its middle.
_FOLLOWS, _SEES_ALL = (-1.9, 1.6, 0.55), (-0.55, 2.1, 1.05)


def walked(rectified: Rectified) -> bool:
    """Whether any frame's place in the room is known, from the camera or the world's origin."""
    root = rectified.level.root
    return root is not None and bool(is_finite(root).any())


def log_room(recording: rr.RecordingStream, take: Take, size: float) -> None:
    """The place of `level` in the room; walk/along, which goes along with the pelvis over the floor; walk/floor, its
    lines; walk/path, the pelvis path on it; and walk/camera, a camera that stands still.

    Without a path the person stays where they are. size: about half the person's height."""
    import rerun as rr

    rectified, poses = take.need("rectified"), take.need("poses")
    level, clock = rectified.level, time_columns(poses.frame_index, poses.times)
    root = np.zeros((len(level), 3)) if level.root is None or not walked(rectified) else level.root
    path = on_lines(root[:, :2], np.arange(len(root)))
    over_floor = np.column_stack([np.nan_to_num(path), np.full(len(root), _ground(rectified, size))])
    recording.send_columns("level", clock, rr.Transform3D.columns(translation=root))
    recording.send_columns("walk/along", clock, rr.Transform3D.columns(translation=over_floor))
    _log_floor(recording, over_floor, size)
    if not walked(rectified):
        return
    strips = [over_floor[piece] for piece in runs(is_finite(root), level.times, breaks(level))]
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


def _log_floor(recording: rr.RecordingStream, over_floor: np.ndarray, size: float) -> None:
    """walk/floor: lines under the path and around it, as far apart as a quarter of the person's height."""
    import rerun as rr

    low, high = np.percentile(over_floor[:, :2], (1, 99), axis=0) + _AROUND * size * np.array([[-1], [1]])
    step = max(size / 2, float((high - low).max()) / _MOST_LINES)
    low, high = np.floor(low / step) * step, np.ceil(high / step) * step
    strips = [[(x, low[1]), (x, high[1])] for x in np.arange(low[0], high[0] + step / 2, step)]
    strips += [[(low[0], y), (high[0], y)] for y in np.arange(low[1], high[1] + step / 2, step)]
    lines = np.array(strips)
    lines = np.concatenate([lines, np.full((*lines.shape[:2], 1), over_floor[0, 2])], axis=-1)
    recording.log("walk/floor", rr.LineStrips3D(lines, colors=[_FLOOR], radii=[-0.7]), static=True)


def _camera_axes(take: Take) -> np.ndarray | None:
    """(3, 3) R_level_from_camera of a camera that stands still, whose centre is then LEVEL's origin; None where the
    path is counted from elsewhere."""
    source, rectified = take.need("poses").frame, take.need("rectified")
    if source.family != "camera" or rectified.R_source_from_level.ndim == 3:
        return None
    return rectified.R_source_from_level.T @ source.basis


def _ground(rectified: Rectified, size: float) -> float:
    """Height of the floor in LEVEL; half the person's height, `size`, under the pelvis where no foot is ever seen."""
    level = rectified.level
    height = floor_height(level)
    if np.isfinite(height):
        return height
    pelvis = 0.0 if level.root is None or not walked(rectified) else float(np.nanmedian(level.root[:, 2]))
    return pelvis - size


def first_view(take: Take, size: float) -> rrb.View:
    """The person on the floor. size: about half the person's height."""
    middle = np.array([0, 0, 0.85 * size])
    name = "The person on the floor, LEVEL"
    return person_view(
        "walk/along",
        name if take.need("rectified").level_ok else f"{name}; not levelled",
        middle + size * _towards_eye(take, _FOLLOWS),
        middle,
        contents=["+ /walk/floor", "+ /walk/path/**", "+ /level/**"],
    )


def walk_view(take: Take, size: float) -> rrb.View:
    """All of the path at once, and the camera too. size: about half the person's height."""
    level = take.need("rectified").level
    assert level.root is not None  # as `walked` says
    joints = level.without_feet.joints + level.root[:, None]
    low, high = (np.nanpercentile(joints, share, axis=(0, 1)) for share in (1, 99))
    if _camera_axes(take) is not None:
        low, high = np.minimum(low, 0), np.maximum(high, 0)
    reach = max(size, 0.45 * float(np.linalg.norm(high - low)))
    middle = (low + high) / 2
    eye = middle + reach * _towards_eye(take, _SEES_ALL)
    contents = ["+ /walk/**", "+ /level/**"]
    return person_view("walk", "All of the path: LEVEL", eye, middle, contents=contents)


def _towards_eye(take: Take, place: tuple[float, float, float]) -> np.ndarray:
    """(3,) in LEVEL: along the view over the floor of a camera that stands still, to that side of it from which people
    come towards the eye, as they face -x, and up. Without such a view it is from where they face, to their right."""
    ahead, aside, up = place
    R_level_from_camera = _camera_axes(take)
    looks = np.zeros(2) if R_level_from_camera is None else R_level_from_camera[:2, 2]
    length = np.linalg.norm(looks)
    x, y = looks / length if length > 1e-6 else (1.0, 0.0)
    beside = np.array([-y, x] if y >= 0 else [y, -x])
    return np.append(ahead * np.array([x, y]) + aside * beside, up)
