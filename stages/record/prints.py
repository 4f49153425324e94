"""Foot prints: where each foot stands, from when it lands, and the floor that they lie on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...models.gait.of_take import SIDES, body_joints, gait_of
from ...models.gait.parameters import places
from ...pipeline.core.layouts import FEET
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import transpose, unit
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import breaks
from ..drawing.palette import LEFT, RIGHT
from ..drawing.rerun_log import time_columns

if TYPE_CHECKING:
    import rerun as rr

# Of a foot, in sizes of the person (about half the stature): it is 0.152 of the stature long (Winter, Biomechanics and
# Motor Control of Human Movement, 4th ed. 2009, figure 4.1), and a quarter of that lies behind the ankle.
_LENGTH, _WIDTH, _BEHIND = 0.3, 0.11, 0.25
_ROUND = np.linspace(0, 2 * np.pi, 25)
_COLOURS = {"right": RIGHT, "left": LEFT}


@dataclass(frozen=True, eq=False)
class FootPrint:
    """Where one foot stands. side: "right" or "left". start_s: its initial contact. place: (3,) in LEVEL, the middle of
    the stance: the ankle over the floor, and the height of the foot's lowest point. ahead: (2,) unit, heel to toe."""

    side: str
    start_s: float
    place: np.ndarray
    ahead: np.ndarray


def foot_prints(take: Take) -> list[FootPrint]:
    """Of every stance whose beginning and place are seen; none where the pelvis path or the angles are not known, or
    the take could not be levelled."""
    filtered, columns, rectified = take.filtered, take.kinematics, take.need("rectified")
    if filtered is None or columns is None or rectified.level.root is None or not rectified.level_ok:
        return []
    gait = gait_of(body_joints(filtered, rectified), filtered, rectified, columns)
    level = rectified.level
    found = []
    for words, side in SIDES.items():
        tracks = np.hstack([_standing(level, side), _ahead(rectified, side)])
        for start_s, (*place, x, y, _) in places(tracks, level.times, gait.feet[side], breaks(level)).items():
            if np.isfinite([*place, x, y]).all():
                found.append(FootPrint(words, start_s, np.array(place), unit(np.array([x, y]))))
    return found


def _standing(level: PoseSequence, side: str) -> np.ndarray:
    """(T, 3) in the room: the ankle over the floor, and the height of the foot's lowest point."""
    ankle = level.joint(f"{side}_ankle").astype(np.float64)
    lowest = ankle[:, 2]
    if level.feet is not None:
        own = [i for i, point in enumerate(FEET.joints) if point.startswith(f"{side}_")]
        lowest = np.fmin(lowest, np.fmin.reduce(level.feet[:, own, 2], axis=1))
    assert level.root is not None  # or there is no print
    return np.column_stack([ankle[:, :2], lowest]) + level.root


def _ahead(rectified: Rectified, side: str) -> np.ndarray:
    """(T, 2) from heel to toe over the floor, or where the person faces in frames without them."""
    level = rectified.level
    facing = -(transpose(rectified.R_source_from_level) @ rectified.R_source_from_body)[:, :2, 0]
    if level.feet is None:
        return facing
    heel, toe = (level.feet[:, FEET.index(f"{side}_{part}"), :2] for part in ("heel", "big_toe"))
    along = unit(toe.astype(np.float64) - heel)
    return np.where(np.isfinite(along), along, facing)


def log_prints(
    recording: rr.RecordingStream,
    prints: Sequence[FootPrint],
    ground: float,
    clock: PoseSequence,
    size: float,
) -> None:
    """walk/prints/right and /left: an outline on the floor, at the row in which the foot lands. The view shows all of
    them up to its time (`walk_view`). ground: the floor's height."""
    import rerun as rr

    for side, colour in _COLOURS.items():
        own = [one for one in prints if one.side == side]
        if not own:
            continue
        look = rr.LineStrips3D.from_fields(colors=[colour], radii=[0.012 * size])
        recording.log(f"walk/prints/{side}", look, static=True)
        rows = np.searchsorted(clock.times, [one.start_s for one in own])
        columns = rr.LineStrips3D.columns(strips=[_outline(one, ground, size) for one in own])
        at = time_columns(clock.frame_index[rows], clock.times[rows])
        recording.send_columns(f"walk/prints/{side}", at, columns)


def _outline(one: FootPrint, ground: float, size: float) -> np.ndarray:
    """(25, 3) a closed curve about the foot, broader at the toes."""
    length, width = _LENGTH * size, _WIDTH * size
    along = (0.5 + 0.5 * np.cos(_ROUND) - _BEHIND) * length
    aside = 0.5 * width * np.sin(_ROUND) * (1 + 0.25 * np.cos(_ROUND))
    x, y = one.ahead
    over_floor = one.place[:2] + along[:, None] * (x, y) + aside[:, None] * (-y, x)
    return np.column_stack([over_floor, np.full(len(_ROUND), ground)])
