"""What motion capture has in common: a world whose up is known, joints or markers under names in use."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np

from ...pipeline.core.errors import InputError, naming
from ...pipeline.core.frames import CAMERA, UNITS, Y_UP, Z_UP, Frame
from ...pipeline.core.layouts import H36M17, LIMBS, Layout
from ...pipeline.core.notices import notice
from ...pipeline.core.pose import UNSAID, MadeBy, PoseSequence
from ...pipeline.core.rotations import is_finite, rotate, transpose, unit
from ...pipeline.files.markers import Markers, Up, by_subject
from ...pipeline.files.skeletons import UNITS as METRES
from ...pipeline.files.skeletons import h36m17_named, leg_length, unit_by_legs
from .names import joints_named

_UPRIGHT = 0.5  # cosine to the vertical
_STANDS = {
    "z": (Z_UP, 2, 1.0),
    "y": (Y_UP, 1, 1.0),
    "camera": (CAMERA.with_(origin="camera"), 1, -1.0),
}  # axis and sign of up
_STANDING = 0.7  # cosine of legs and trunk to the vertical in the usual frame
_TOLD_UP = "give the vertical axis with up=y or up=z (--option up=z), which is then used"
_UNITS = ("m", "cm", "mm")
LENGTHS = tuple(unit for unit in UNITS if unit not in ("px", "arbitrary"))


def world(up: Up, unit: str) -> Frame:
    """The world frame with that axis up; InputError for a unit that is no length."""
    if unit not in LENGTHS:
        raise InputError(
            "needs-input", f"Expected a unit of {', '.join(LENGTHS)}, got '{unit}'; give it with unit=."
        )
    return (Y_UP if up == "y" else Z_UP).with_(unit=unit)


Maker = Literal["measured", "estimated"]


def maker(kind: Maker | None, says: MadeBy = UNSAID) -> MadeBy:
    """Who made the poses of a file: as the user tells, else as the file says."""
    return says if kind is None else MadeBy(kind, says.by if kind == says.kind else "")


def reader_of(
    points: Callable[[Path], Markers],
) -> Callable[..., tuple[PoseSequence, ...]]:
    """`read` of an adapter whose files hold named points. points: those of a file."""

    def read(
        path: Path, unit: str | None = None, up: Up | None = None, made_by: Maker | None = None
    ) -> tuple[PoseSequence, ...]:
        """The person of the file, or each of its subjects by name, in the file's own world and unit, with its times.

        unit: "m", "mm", "cm" or "inch", instead of the file's. up: "y" or "z", the axis that is up; without it the
        person has to stand along the one that is taken for up. made_by: "measured" or "estimated", instead of what the
        file says. InputError when the file is of another form, or its points are not joint centres under names in use.
        """
        with naming(path):
            markers = points(path)
        return people_of(markers, str(path), unit, up, maker(made_by, markers.made_by))

    return read


def people_of(
    markers: Markers, where: str, unit: str | None, up: Up | None, made_by: MadeBy = UNSAID
) -> tuple[PoseSequence, ...]:
    """Everybody of named points, in the file's world and unit, with its times; frames count from the first row.

    Points of several subjects (`by_subject`) are as many people of their names; a subject whose points make no body,
    such as a ball, is left out, and the history warns. unit, up: instead of what the file says. made_by: who made them.
    InputError when nobody's points are joint centres under names in use, when the unit is unknown, and when somebody
    does not stand along the axis that the file's kind has up.
    """
    frame = world(up or markers.up, unit or markers.unit)
    subjects = by_subject(markers)
    people, reasons = [], {}
    for name, points in subjects.items():
        place, named = (where, {}) if len(subjects) == 1 else (f"{where}, subject {name}", {"person": name})
        try:
            people.append(_person(points, place, frame, up, made_by).with_(**named))
        except _NoBodyError as error:
            reasons[name] = error
    if not people:
        raise next(iter(reasons.values()))
    if not reasons:
        return tuple(people)
    left_out = notice("no-joint-centres", people=" and ".join(reasons))
    return tuple(poses.noted("subjects", left_out=list(reasons)).saying(left_out) for poses in people)


class _NoBodyError(InputError):
    """Points that are not the joint centres of a body."""


def _person(markers: Markers, where: str, frame: Frame, up: Up | None, made_by: MadeBy) -> PoseSequence:
    layout, joints, made = _named(markers, METRES[frame.unit])
    poses = PoseSequence(
        joints=joints,
        layout=layout,
        frame=frame,
        time_s=markers.time_s,
        frame_index=markers.numbers - markers.numbers[0],
        frames_known=False,
        made_by=made_by,
    )
    if up is None:
        check_upright(poses, where)
    return poses.deriving("markers", made) if made else poses


def _named(markers: Markers, metres: float) -> tuple[Layout, np.ndarray, dict[str, str]]:
    """metres: one unit of the points. A prefix that all names share ("Ann_RHip") does not matter."""
    shared = len(os.path.commonprefix(markers.names))  # noqa: RUF071 (characters are meant, these are no paths)
    plain = [name[shared:] for name in markers.names]
    chosen = joints_named(plain)
    direct = Layout("markers", tuple(chosen)), markers.points[:, list(chosen.values())]
    if set(chosen) >= {"nose", *LIMBS}:
        return *direct, {}
    try:
        joints = h36m17_named(markers.points * metres, plain) / metres
    except InputError:
        if set(chosen) >= set(LIMBS):  # no head, but enough of a body
            return *direct, {}
        raise _NoBodyError(
            "wrong-content",
            "expected points at the joint centres (hips, knees, ankles, shoulders, elbows and wrists, under common "
            f"names), got {', '.join(markers.names[:30])}; markers on the skin must be turned into joint centres "
            "first.",
        ) from None
    return H36M17, joints, {"nose": "before the neck's end, as the shoulders face", "head": "along the neck"}


def upright(points: np.ndarray, layout: Layout) -> np.ndarray:
    """(2, 3) the directions in which legs and trunk of points (T, J, 3) point upwards, in the usual frame."""

    def middle(part: str) -> np.ndarray:
        return points[:, layout.indices((f"l_{part}", f"r_{part}"))].mean(axis=1, dtype=np.float64)

    parts = (middle("hip") - middle("ankle"), middle("shoulder") - middle("hip"))
    directions = [unit(part[is_finite(part)]) for part in parts]
    return np.stack([np.median(part, axis=0) if len(part) else np.full(3, np.nan) for part in directions])


def check_upright(poses: PoseSequence, where: str, way_out: str = _TOLD_UP) -> None:
    """InputError unless, in the usual frame, legs and trunk point along the axis that is taken for up. way_out: what
    the user can do, in words."""
    stands = rotate(transpose(poses.frame.basis), upright(poses.joints, poses.layout))[:, 2]
    if (stands < _UPRIGHT).all():
        axis = "y" if poses.frame.axes[1] == "up" else "z"
        raise InputError(
            "wrong-axes",
            f"{where}: expected a person who stands along +{axis}, the axis that is up in such files, but in most "
            f"frames the head is not above the feet; {way_out}.",
        )


def standing_frame(points: np.ndarray, layout: Layout, up: str | None, unit: str | None, where: str) -> Frame:
    """The axes and the unit in which points (T, J, 3) are a person who stands, unless they are told: up as "z", "y" or
    "camera". InputError where neither tells."""
    if up not in (None, *_STANDS):
        raise InputError("bad-value", f"Expected up of {', '.join(_STANDS)}, got '{up}'.")
    if up is None:
        stands = upright(points, layout)
        fits = [key for key, (_, axis, sign) in _STANDS.items() if (sign * stands[:, axis] > _STANDING).all()]
        if not fits:
            raise InputError(
                "wrong-axes",
                f"{where}: expected a person who stands along +z, +y or, in a camera's axes, -y, got one who does not; "
                "give the vertical axis with up=z, up=y or up=camera (-O up=z), or level the file's axes first.",
            )
        up = fits[0]
    with naming(where):
        return _STANDS[up][0].with_(unit=unit or unit_by_legs(leg_length(points, layout), _UNITS))
