"""The person in LEVEL where they are in the room, and the way they take over the floor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.layouts import FEET, with_feet
from ...pipeline.motion.signals import breaks, runs
from ...pipeline.pose import PoseSequence, Rectified
from ...pipeline.rotations import is_finite
from ..drawing.rerun_log import log_skeleton

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_PATH = (110, 140, 255)
_EYE = (-1.6, 1.3, 0.7)  # from the middle of the way, in the reach of the scene


def walked(rectified: Rectified) -> PoseSequence | None:
    """LEVEL with every joint in the room, from the camera or the world's origin; None where that is not known."""
    level = rectified.level
    if level.root is None or not is_finite(level.root).any():
        return None
    root = level.root[:, None]
    return level.mapped(lambda points: points + root, root=None, root_covariance=None)


def log_walk(recording: rr.RecordingStream, rectified: Rectified, size: float) -> None:
    """`walk`, the skeleton, and `walk/path`, the pelvis's way as a line on the floor."""
    import rerun as rr

    placed, level = walked(rectified), rectified.level
    if placed is None or level.root is None:
        return
    log_skeleton(recording, "walk", with_feet(placed), radius=0.024 * size)
    path = level.root.copy()
    path[:, 2] = floor(placed)
    pieces = runs(np.asarray(is_finite(path)) & np.asarray(is_finite(level.root)), level.times, breaks(level))
    strips = [path[piece] for piece in pieces]
    look = rr.LineStrips3D(strips, colors=[_PATH] * len(strips), radii=[0.012 * size] * len(strips))
    recording.log("walk/path", look, static=True)


def walk_view(placed: PoseSequence, size: float) -> rrb.View:
    """All of the way at once. size: about half the person's height."""
    import rerun as rr
    import rerun.blueprint as rrb

    low, high = (np.nanpercentile(placed.joints, share, axis=(0, 1)) for share in (1, 99))
    reach = max(size, 0.45 * float(np.linalg.norm(high - low)))
    plane = rr.components.Plane3D.XY.with_distance(floor(placed))
    middle = (low + high) / 2
    return rrb.Spatial3DView(
        origin="walk",
        name="Through the room: LEVEL",
        eye_controls=rrb.EyeControls3D(position=middle + reach * np.array(_EYE), look_target=middle),
        line_grid=rrb.LineGrid3D(plane=plane, spacing=size / 2, color=(128, 128, 128, 110)),
    )


def floor(placed: PoseSequence) -> float:
    """The height of the lowest heels, toes and ankles, or without any of the lowest joint; NaN without joints."""
    points = with_feet(placed)
    low = [joint for joint in points.layout.joints if joint in FEET or joint.endswith("ankle")]
    for rows in (points.layout.indices(low), slice(None)):
        heights = points.joints[:, rows, 2]
        heights = heights[np.isfinite(heights)]
        if len(heights):
            return float(np.percentile(heights, 2))
    return float("nan")
