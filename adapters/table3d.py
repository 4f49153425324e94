"""Tables of 3D joints under common names: anipose's pose-3d CSV, and those of own scripts.

Columns are "left_knee_x, _y, _z", beside anipose's _error, _ncams and _score, or a row is a joint. Nothing says which
axis is up and which unit it is: the person has to stand along +z or +y of a world, or -y of a camera's axes, and the
legs to be an adult's in metres, centimetres or millimetres, unless options say it. anipose's own axes are those of a
camera unless its config has `axes`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import LIMBS, Layout
from ..pipeline.core.pose import PoseSequence
from . import freemocap, mediapipe, mhr70
from .kit.names import joints_named
from .kit.people import People
from .kit.tables import column_names, header_of, read_points
from .kit.world import Maker, maker, standing_frame

name = "table3d"
gives = "poses"
general = True
reads = (
    "tables of 3D joints under common names: anipose's CSV, a column or a row a joint, in a world or a camera"
)


def sniff(path: Path) -> bool:
    header = header_of(path)
    if header is None or header.dims != 3 or not set(LIMBS) <= joints_named(sorted(header.points)).keys():
        return False
    return not any(other.sniff(path) for other in (freemocap, mediapipe, mhr70))


def lacks(path: Path) -> str:
    """The limbs that a table of others of a body's joints has not, or that it names no columns; "" for anything else.
    Never raises."""
    header = header_of(path)
    if header is None and len(numbers := column_names(path)) > len(LIMBS) and all(map(_is_number, numbers)):
        return (
            "its first line names no columns; put a line such as frame,x0,y0,z0,x1,y1,z1 and so on before it"
        )
    named = {} if header is None or header.dims != 3 else joints_named(sorted(header.points))
    missing = [joint for joint in LIMBS if joint not in named]
    return f"it has no {', '.join(missing)}" if 0 < len(missing) < len(LIMBS) else ""


def read(
    path: Path,
    up: str | None = None,
    unit: str | None = None,
    track: bool = False,
    made_by: Maker | None = None,
) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the name that the table gives, or joined from frame to frame by nearness.

    up: "z" or "y", the axis of a world that is up, or "camera" for x right, y down, z away. unit: "m", "cm" or "mm".
    track: ignore the names of people. made_by: "measured" or "estimated", which the file does not say. InputError for a
    table without hips, knees, ankles, shoulders, elbows and wrists, and where neither the body nor an option tells the
    axes and the unit.
    """
    held = read_points(path, "a table of 3D joints")
    named = joints_named(held.names)
    if missing := [joint for joint in LIMBS if joint not in named]:
        raise InputError(
            "wrong-content",
            f"{path}: expected x, y and z of {', '.join(LIMBS)} under common names, but {', '.join(missing)} lack; got "
            f"{', '.join(held.names[:12])}.",
        )
    layout, sightings = Layout("table", tuple(named)), People(str(path))
    values = held.values[:, list(named.values())]
    gone = (values[..., :3] == 0).all(axis=-1)
    values[gone] = np.nan
    for moment, person, row in zip(held.moments.tolist(), held.people, values, strict=True):
        if np.isfinite(row[:, :3]).any():
            sightings.add(moment, row[:, :3], row[:, 3], None if track else person)
    frame = standing_frame(sightings.points, layout, up, unit, str(path))
    people = sightings.poses(layout, frame, held.clock, placed=True)
    return tuple(poses.with_(made_by=maker(made_by)) for poses in people)


def _is_number(cell: str) -> bool:
    return cell.lstrip("+-")[:1].isdigit()
