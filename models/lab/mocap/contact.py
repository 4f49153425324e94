"""When a foot of motion capture is on the floor: what contacts are learned from and judged by.

The layout has one joint of the foot, the ankle, so the foot itself is put below it. A foot rests where its ankle is
slower than 0.5 m/s and within 6 cm of that foot's own floor level. There it lies flat: its forefoot, the heads of the
metatarsals, is 0.08 statures ahead of the ankle as the person faces, and 0.03 below it (a foot is 0.152 statures long
and the ankle 0.039 high; Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, figure 4.1). The
contact goes on, to both sides of the rest, for as long as the ankle can be where it is with some part of the foot in
place: within 3.5 cm of its place at rest, or at its distance from the forefoot, within 2.5 cm (the heel is off, and the
ankle turns about the forefoot until the toes leave). By 3.5 cm an ankle 8 cm from the end of its heel moves while a
foot that landed with its toes up by 25 degrees comes down.

On the walks of the train subjects a stance then takes 61 % of a stride and double support 22 %, as in gait laboratories
(with 5 cm 63 and 25 %). On a walk annotated elsewhere (gaitkit 1.5.0, one person, six landings) feet land 16 ms early
in the median (with 5 cm 33) and leave 44 to 66 ms late.
"""

from __future__ import annotations

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.layouts import H36M17
from ....pipeline.signals.filters import derivative, runs
from ...common.canonical import R_world_from_body

_RESTS_MPS = 0.5
_LOW_M = 0.06  # above the foot's own floor level
_FLOOR_SHARE = 5.0  # percentile of the ankle's height that is its floor level
_AHEAD, _BELOW = 0.08, 0.03  # statures: the forefoot's joints ahead of the ankle and below it
_SETTLES_M = 0.035
_ON_ARC_M = 0.025


def true_contact(joints: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """{"r", "l": (N, 2) initial contact and toe-off in seconds}, in order; NaN where the take begins or ends so.

    joints: (T, 17, 3) metres, H36M17, a still world with +Z up and one level floor; time_s (T,).
    """
    joints = joints.astype(np.float64)
    ahead = -R_world_from_body(joints)[..., 0]
    stature = implied_stature(joints)
    return {side: _spells(joints[:, H36M17.index(f"{side}_ankle")], ahead, stature, time_s) for side in "rl"}


def _spells(ankle: np.ndarray, ahead: np.ndarray, stature: float, time_s: np.ndarray) -> np.ndarray:
    speed = np.linalg.norm(derivative(ankle, time_s), axis=-1)
    floor = np.percentile(ankle[:, 2], _FLOOR_SHARE)
    found: list[list[float]] = []
    for rest in runs((speed < _RESTS_MPS) & (ankle[:, 2] < floor + _LOW_M), time_s):
        flat = rest.start + int(np.argmin(speed[rest]))
        off = _off(ankle, flat, ahead[flat], stature)
        start = _leaves(off[: flat + 1][::-1], time_s[: flat + 1][::-1])
        stop = _leaves(off[flat:], time_s[flat:])
        if found and not start > found[-1][1]:  # another rest of the same contact
            found[-1][1] = stop if np.isnan(stop) or stop > found[-1][1] else found[-1][1]
        else:
            found.append([start, stop])
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def _off(ankle: np.ndarray, flat: int, ahead: np.ndarray, stature: float) -> np.ndarray:
    """(T,) by how much an ankle (T, 3) is beyond what a foot that rests in row `flat` allows: 0 and less is contact,
    in shares of what is allowed."""
    place = ankle[flat]
    forefoot = place + stature * (_AHEAD * ahead - (0.0, 0.0, _BELOW))
    moved = np.linalg.norm(ankle - place, axis=-1) / _SETTLES_M - 1
    arc = np.abs(np.linalg.norm(ankle - forefoot, axis=-1) - np.linalg.norm(place - forefoot)) / _ON_ARC_M - 1
    return np.minimum(moved, arc)


def _leaves(off: np.ndarray, time_s: np.ndarray) -> float:
    """The moment at which `off` becomes positive for the first time, between rows; NaN if it does not."""
    beyond = np.flatnonzero(off > 0)
    if not len(beyond):
        return float("nan")
    row = int(beyond[0])
    return float(np.interp(0.0, off[row - 1 : row + 1], time_s[row - 1 : row + 1]))
