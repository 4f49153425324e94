"""Which views the recording opens with, and where they look from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...models.common.residuals import has_residuals
from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.frames import BODY
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ..drawing.facts import OWN_WAYS, ways_of_level
from ..drawing.rerun_log import person_view
from .angles import angle_views, angled, first_angles
from .first import first_view
from .walk import walk_view, walked

if TYPE_CHECKING:
    import rerun.blueprint as rrb

OFF_KEYPOINTS = "off_keypoints"  # entity: how far each limb is from its keypoints
# Where the eye stands, in sizes of the person from the pelvis and in the reference axes of a frame's family.
_EYES = {
    "camera": (0.5, -0.4, -2.4),  # near the camera itself
    "world": (-2.2, 1.1, 0.5),
    "body": (-2.2, 1.1, 0.5),  # in front of the person, who faces -x, to the right and a little above
}


def views(take: Take, size: float) -> rrb.Container:
    """A tab for a first look: the video, the person on the floor, and below them knees, elbows and trunk; another for
    all else. Views of what the take lacks are not there.

    size: about half the person's height, in the poses' unit.
    """
    import rerun.blueprint as rrb

    flat = {"Video": take.video, "2D keypoints": take.keypoints}
    title = " and ".join(name for name, part in flat.items() if part is not None)
    video = [rrb.Spatial2DView(origin="video", name=title, visual_bounds=_bounds(take))] if title else []
    charts = first_angles(take)
    first = rrb.Vertical(
        rrb.Horizontal(*video, first_view(take, size)),
        *([rrb.Horizontal(*charts)] if charts else []),
        row_shares=[5, 3] if charts else [1],
        name="First look",
    )
    return rrb.Tabs(first, _details(take, size), active_tab=0)


def _details(take: Take, size: float) -> rrb.Container:
    """On the left poses before and after, in the middle the path and the angles, on the right wrists, rotation and
    words."""
    import rerun.blueprint as rrb

    rectified, source = take.need("rectified"), take.need("poses").frame
    placed = walked(rectified)
    front, right = ways = ways_of_level(rectified.level_heading)
    after = ("back", "right", "up") if ways == OWN_WAYS else (f"from {front}", f"to {right}", "up")
    after = after if rectified.camera != "moving" else ("back", "right (relative)", "up")
    texts: list[rrb.View] = [rrb.TextDocumentView(origin="summary", name="Summary")]
    if take.notices:
        columns = rrb.TextLogColumns(timeline_columns=["frame"], text_log_columns=["loglevel", "body"])
        texts.append(rrb.TextLogView(origin="events", name="Events", columns=columns))
    unit = source.unit if source.metric else "arbitrary units"
    curves = [
        _wrists("level", f"Wrists after ({unit})", after),
        _wrists("source", f"Wrists before ({unit})", source.axes),
        _curves("rotation", "Rotation (deg)"),
        *([_curves(OFF_KEYPOINTS, "Limbs off keypoints (% of stature)")] if has_residuals(take) else []),
    ]
    columns = [
        [
            _person("source", f"Before: {source.name} axes", take, size),
            _person("body", "After: BODY, facing you", take, size),
        ],
        [
            *([walk_view(take, placed, size)] if placed is not None else []),
            *([angle_views(take)] if angled(take) else []),
        ],
        [rrb.Tabs(*curves, active_tab=0), rrb.Tabs(*texts, active_tab=0)],
    ]
    return rrb.Horizontal(*(rrb.Vertical(*column) for column in columns if column), name="Details")


def _wrists(entity: str, name: str, axes: Sequence[str]) -> rrb.Container:
    """A view for each axis, right orange, left blue."""
    import rerun.blueprint as rrb

    views = [
        rrb.TimeSeriesView(
            origin=f"wrists/{entity}/{letter}", name=axis, plot_legend=rrb.PlotLegend(visible=False)
        )
        for letter, axis in zip("xyz", axes, strict=True)
    ]
    return rrb.Vertical(*views, name=name)


def _bounds(take: Take) -> rrb.VisualBounds2D | None:
    """All that the keypoints reach during the take, when there is no video whose image gives the bounds."""
    import rerun.blueprint as rrb

    if take.video is not None or take.keypoints is None:
        return None
    pixels = take.keypoints.joints[is_finite(take.keypoints.joints)]
    if len(pixels) == 0:
        return None
    low, high = np.percentile(pixels, [0.5, 99.5], axis=0)
    margin = 0.08 * (high - low).max()
    (x_0, y_0), (x_1, y_1) = low - margin, high + margin
    return rrb.VisualBounds2D(x_range=(x_0, x_1), y_range=(y_0, y_1))


def _person(entity: str, name: str, take: Take, size: float) -> rrb.View:
    frame = take.need("poses").frame if entity == "source" else BODY
    grid = None
    if entity != "source":
        height = floor_height(take.need("rectified").body)
        grid = (height if np.isfinite(height) else -size), size / 4
    return person_view(entity, name, size * frame.basis @ np.array(_EYES[frame.family]), grid=grid)


def _curves(entity: str, name: str) -> rrb.View:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(origin=entity, name=name, plot_legend=rrb.Corner2D.LeftTop)
