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
from ..pipeline.core.frames import CAMERA, METRES, Y_UP, Z_UP
from ..pipeline.core.layouts import LIMBS, Layout
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.skeletons import LEG_M
from . import freemocap, mediapipe, mhr70
from .kit.names import joints_named
from .kit.people import People
from .kit.tables import header_of, read_points
from .kit.world import Maker, maker, upright

name = "table3d"
gives = "poses"
reads = (
    "tables of 3D joints under common names: anipose's CSV, a column or a row a joint, in a world or a camera"
)
marks = ("x", "y", "z", "knee", "wrist")

_UP = {
    "z": (Z_UP, 2, 1.0),
    "y": (Y_UP, 1, 1.0),
    "camera": (CAMERA.with_(origin="camera"), 1, -1.0),
}  # axis and sign of up
_UPRIGHT = 0.7  # cosine of legs and trunk to the vertical in the usual frame
_UNITS = ("m", "cm", "mm")


def sniff(path: Path) -> bool:
    header = header_of(path)
    if header is None or header.dims != 3 or not set(LIMBS) <= joints_named(sorted(header.points)).keys():
        return False
    return not any(other.sniff(path) for other in (freemocap, mediapipe, mhr70))


def read(
    path: Path,
    up: str | None = None,
    unit: str | None = None,
    track: bool = False,
    made_by: Maker | None = None,
    recording: str | None = None,
) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the name that the table gives, or joined from frame to frame by nearness.

    up: "z" or "y", the axis of a world that is up, or "camera" for x right, y down, z away. unit: "m", "cm" or "mm".
    track: ignore the names of people. made_by: "measured" or "estimated", which the file does not say. recording: of
    several in one table the one to read. InputError for a table without hips, knees, ankles, shoulders, elbows and
    wrists, and where neither the body nor an option tells the axes and the unit.
    """
    held = read_points(path, "a table of 3D joints", recording=recording)
    named = joints_named(held.names)
    if missing := [joint for joint in LIMBS if joint not in named]:
        raise InputError(
            "wrong-content",
            f"{path}: expected x, y and z of {', '.join(LIMBS)} under common names, but {', '.join(missing)} lack; got "
            f"{', '.join(held.names[:12])}.",
        )
    layout, found = Layout("table", tuple(named)), People(str(path))
    values = held.values[:, list(named.values())]
    gone = (values[..., :3] == 0).all(axis=-1)
    values[gone] = np.nan
    for moment, person, row in zip(held.moments.tolist(), held.people, values, strict=True):
        if np.isfinite(row[:, :3]).any():
            found.add(moment, row[:, :3], row[:, 3], None if track else person)
    if not len(found):
        raise InputError("nothing-usable", f"{path}: no person was found in any frame.")
    frame = _UP[_axis(found.points, layout, up, str(path))][0].with_(
        unit=_unit(found.points, layout, unit, str(path))
    )
    people = found.poses(layout, frame, held.clock, placed=True)
    return tuple(poses.with_(made_by=maker(made_by)) for poses in people)


def _axis(points: np.ndarray, layout: Layout, told: str | None, where: str) -> str:
    """The key of _UP by what was told, or by the body."""
    if told is not None:
        if told not in _UP:
            raise InputError("bad-value", f"Expected up of {', '.join(_UP)}, got '{told}'.")
        return told
    stands = upright(points, layout)
    fits = [key for key, (_, axis, sign) in _UP.items() if (sign * stands[:, axis] > _UPRIGHT).all()]
    if not fits:
        raise InputError(
            "wrong-axes",
            f"{where}: expected a person who stands along +z, +y or, in a camera's axes, -y, got one who does not; "
            "give the vertical axis with up=z, up=y or up=camera (-O up=z), or level the file's axes first.",
        )
    return fits[0]


def _unit(points: np.ndarray, layout: Layout, told: str | None, where: str) -> str:
    if told is not None:
        return told
    at = {joint: points[:, i] for i, joint in enumerate(layout.joints)}
    legs = [
        np.linalg.norm(at[f"{s}_{a}"] - at[f"{s}_{b}"], axis=-1)
        for s in "lr"
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    ]
    leg = float(np.nanmedian(legs, axis=1).sum() / 2)
    fits = [unit for unit in _UNITS if LEG_M[0] <= leg * METRES[unit] <= LEG_M[1]]
    if not fits:
        raise InputError(
            "needs-input",
            f"{where}: legs of {leg:.4g} are an adult's in none of {', '.join(_UNITS)}; give the unit with unit= (-O "
            "unit=cm).",
        )
    return fits[0]
