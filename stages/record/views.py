"""Which views the recording opens with, and where they look from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.signals.reprojection import residuals_of
from ..drawing.facts import OWN_WAYS, voted, ways_of_level
from .angles import angle_views, angled
from .camera import camera_view, looked
from .prints import FootPrint
from .up import cap
from .walk import floor, walk_view, walked

if TYPE_CHECKING:
    import rerun.blueprint as rrb

OFF_KEYPOINTS = "off_keypoints"  # entity: how far each limb is from its keypoints
# Where the eye stands, in sizes of the person from the pelvis and in the reference axes of a frame's family.
_EYES = {
    "camera": (0.5, -0.4, -2.4),  # near the camera itself
    "world": (-2.2, 1.1, 0.5),
    "body": (-2.2, 1.1, 0.5),  # in front of the person, who faces -x, to the right and a little above
    "level": (-2.2, 1.1, 0.5),
}


def blueprint(take: Take, prints: Sequence[FootPrint], size: float) -> rrb.Blueprint:
    """Left what came in, in the middle the rectified person and the angles, right the curves and the words.
    Where the person's place is known, it opens with their walk.

    size: about half the person's height, in the poses' unit. Views of what the take lacks are not there.
    """
    import rerun.blueprint as rrb

    rectified = take.need("rectified")
    source = take.need("poses").frame
    unit = source.unit if source.metric else "arbitrary units"
    front, right = ways = ways_of_level(rectified.level_heading)
    after = "back, right, up" if ways == OWN_WAYS else f"from {front}, to {right}, up"
    after = after if rectified.camera != "moving" else "back, right (relative), up"
    level = "one heading" if rectified.camera != "moving" else "camera's heading"
    flat = {"Video": take.video, "2D keypoints": take.keypoints}
    title = " and ".join(name for name, part in flat.items() if part is not None)
    votes, placed = voted(rectified), walked(rectified)
    words: list[rrb.View] = [rrb.TextDocumentView(origin="summary", name="Summary")]
    if take.measures:
        words.append(rrb.TextDocumentView(origin="measures", name="Measures"))
    if take.notices:
        columns = rrb.TextLogColumns(timeline_columns=["frame"], text_log_columns=["loglevel", "body"])
        words.append(rrb.TextLogView(origin="events", name="Events", columns=columns))
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                *(
                    [rrb.Spatial2DView(origin="video", name=title, visual_bounds=_bounds(take))]
                    if title
                    else []
                ),
                _person("source", f"Before: {source.name} axes", take, size),
            ),
            rrb.Vertical(
                rrb.Tabs(
                    *([walk_view(take, placed, prints, size)] if placed is not None else []),
                    _person("body", "After: BODY, facing you", take, size),
                    _person("level", f"After: LEVEL, {level}", take, size),
                    *([_votes(take)] if votes else []),
                    *([camera_view(take)] if looked(take) else []),
                    active_tab=0,
                ),
                *([angle_views(take)] if angled(take) else []),
                row_shares=[2, 1] if angled(take) else [1],
            ),
            rrb.Vertical(
                _curves("wrists/source", f"Wrists before: {', '.join(source.axes)} ({unit})"),
                _curves("wrists/level", f"Wrists after: {after} ({unit})"),
                rrb.Tabs(
                    _curves("rotation", "Rotation (deg)"),
                    *([_tilt()] if votes else []),
                    *(
                        [_curves(OFF_KEYPOINTS, "Limbs off keypoints (% of stature)")]
                        if residuals_of(take)
                        else []
                    ),
                    active_tab=0,
                ),
                rrb.Tabs(*words, active_tab=0),
                row_shares=[7, 7, 5, 6],
            ),
            column_shares=[3, 4, 4],
        ),
        rrb.TimePanel(state="collapsed", timeline="video_time"),
        collapse_panels=True,
    )


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
    import rerun as rr
    import rerun.blueprint as rrb

    rectified = take.need("rectified")
    poses = {"source": take.need("poses"), "body": rectified.body, "level": rectified.level}[entity]
    eye = size * poses.frame.basis @ np.array(_EYES[poses.frame.family])
    grid = rrb.LineGrid3D(False)
    if entity != "source":
        ground = floor(poses)
        plane = rr.components.Plane3D.XY.with_distance(ground if np.isfinite(ground) else -size)
        grid = rrb.LineGrid3D(plane=plane, spacing=size / 4, color=(128, 128, 128, 110))
    return rrb.Spatial3DView(
        origin=entity,
        name=name,
        eye_controls=rrb.EyeControls3D(position=eye, look_target=(0, 0, 0)),
        line_grid=grid,
    )


def _votes(take: Take) -> rrb.View:
    """The sphere from above and from the camera's side, near enough that the votes fill the view."""
    import rerun.blueprint as rrb

    R_source_from_cap, reach_deg, _ = cap(take)
    middle = R_source_from_cap[:, 2]
    eye = R_source_from_cap @ np.array([0.0, -0.6, 0.8])
    controls = rrb.EyeControls3D(
        position=middle + 3.3 * np.sin(np.radians(reach_deg)) * eye,
        look_target=middle,
        eye_up=R_source_from_cap[:, 1],
    )
    return rrb.Spatial3DView(
        origin="up",
        name="Votes on up, early blue",
        eye_controls=controls,
        line_grid=rrb.LineGrid3D(False),
    )


def _tilt() -> rrb.View:
    import rerun.blueprint as rrb

    # Of the eight curves four are thin lines of the bound; a legend would hide them all.
    return rrb.TimeSeriesView(
        origin="tilt",
        name="Camera's pitch (blue) and roll (orange): votes, take, 90 % bound (deg)",
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _curves(entity: str, name: str) -> rrb.View:
    import rerun.blueprint as rrb

    return rrb.TimeSeriesView(origin=entity, name=name, plot_legend=rrb.Corner2D.LeftTop)
