"""Which views the recording opens with, and where they look from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.frames import BODY
from ...pipeline.core.take import Take
from ..drawing.rerun_log import person_view
from .angles import angle_views, first_angles
from .room import first_view, walk_view, walked

if TYPE_CHECKING:
    import rerun.blueprint as rrb

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
    video = [rrb.Spatial2DView(origin="video", name=title)] if title else []
    charts = first_angles(take)
    first = rrb.Vertical(
        rrb.Horizontal(*video, first_view(take, size)),
        *([rrb.Horizontal(*charts)] if charts else []),
        row_shares=[5, 3] if charts else [1],
        name="First look",
    )
    return rrb.Tabs(first, _details(take, size), active_tab=0)


def _details(take: Take, size: float) -> rrb.Container:
    """On the left the poses before and after, in the middle the path and the angles, on the right rotation and
    words."""
    import rerun.blueprint as rrb

    poses, rectified = take.need("poses"), take.need("rectified")
    source = poses.frame
    eyes = [size * frame.basis @ np.array(_EYES[frame.family]) for frame in (source, BODY)]
    texts: list[rrb.View] = []
    if take.said:
        columns = rrb.TextLogColumns(timeline_columns=["frame"], text_log_columns=["loglevel", "body"])
        texts.append(rrb.TextLogView(origin="events", name="Events", columns=columns))
    texts.append(rrb.TextDocumentView(origin="provenance", name="Provenance"))
    rotation = rrb.TimeSeriesView(origin="rotation", name="Rotation (deg)", plot_legend=rrb.Corner2D.LeftTop)
    columns = [
        [
            person_view("source", f"Before: {source.name} axes", eyes[0]),
            person_view("body", "After: BODY, facing you", eyes[1]),
        ],
        [
            *([walk_view(take, size)] if walked(rectified) else []),
            *angle_views(take),
        ],
        [rotation, rrb.Tabs(*texts, active_tab=0)],
    ]
    return rrb.Horizontal(*(rrb.Vertical(*column) for column in columns if column), name="Details")
