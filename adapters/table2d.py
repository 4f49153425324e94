"""Tables of 2D keypoints: a column for each coordinate, or a row a joint (DeepLabCut, Lightning Pose, own scripts).

Columns name joints ("left_knee_x", "LKnee_likelihood"), in one line or in DeepLabCut's three or four, or number them
("x0", "kp_12_y"), and then their order is told by how many they are. x and y are pixels, or shares of the image's width
and height where its size is known; likelihood, score, conf or visibility is the confidence. Frames, times, people:
kit/clock.py.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import IN_2D, LIMBS, Layout
from ..pipeline.core.pose import PoseSequence
from .kit.names import joints_named
from .kit.people import COUNTS, People, in_pixels
from .kit.tables import header_of, read_points

name = "table2d"
gives = "keypoints"
general = True
reads = (
    "tables of 2D keypoints: CSV of DeepLabCut and Lightning Pose, a column or a row for each joint, pixels"
)

_SHARES = 1.5  # of the image; a joint may lie beside it


def sniff(path: Path) -> bool:
    header = header_of(path)
    if header is None or header.dims != 2:
        return False
    return set(LIMBS) <= joints_named(sorted(header.points)).keys() or _numbered(header.points) > 0


def read(
    path: Path, track: bool = False, image_size: tuple[int, int] | None = None
) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the name that the table gives, or joined from frame to frame by nearness.

    track: ignore the names and join people by nearness all the same. image_size: width and height in pixels, for
    coordinates that are shares of them; a run takes those of its video, or of read.image_size. InputError for a table
    without hips, knees, ankles, shoulders, elbows and wrists.
    """
    held = read_points(path, "a table of 2D keypoints")
    named, layouts = joints_named(held.names), IN_2D
    if set(LIMBS) <= named.keys():
        layouts, columns = (Layout("table", tuple(named)),), list(named.values())
    elif count := _numbered(held.names):
        columns = [held.names.index(str(i)) for i in range(count)]
    else:
        raise InputError(
            "wrong-content",
            f"{path}: expected x and y of {', '.join(LIMBS)} under common names, or of {', '.join(map(str, COUNTS))} "
            f"numbered joints, got {', '.join(held.names[:12])}.",
        )
    points = held.values[:, columns]
    if not np.nanmax(np.abs(points[..., :2]), initial=0) > _SHARES:
        points[..., :2] = in_pixels(points[..., :2], image_size, str(path))
    sightings = People(str(path))
    for moment, person, row in zip(held.moments.tolist(), held.people, points, strict=True):
        if np.isfinite(row[:, :2]).any():
            sightings.add(moment, row[:, :2], row[:, 3], None if track else person)
    return sightings.keypoints(held.clock, layouts)


def _numbered(points: set[str] | tuple[str, ...]) -> int:
    """How many joints are numbered, from 0; 0 where they are not as many as any layout has."""
    return next(
        (count for count in sorted(COUNTS, reverse=True) if {*map(str, range(count))} <= {*points}), 0
    )
