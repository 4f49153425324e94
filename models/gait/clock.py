"""Whether a take's clock is right, by what nobody chooses: how fast a body falls, and how quickly legs swing in a walk.

In the air nothing but gravity pulls. On the ground a leg swings as a pendulum that is driven: whoever walks slowly
stands longer on each foot, but swings it hardly more slowly.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import angle_deg, unit
from ...pipeline.signals.filters import peaks
from ..place.flights import GRAVITY, flown

_STATURE_M = 1.7  # of an adult; of people 1.2 to 2 m tall gravity's fall is within a fifth of the clock
_OFF = 1.5  # times too slow, or too fast, by falls; slow motion is of twice and more
# Seconds in which a leg swings: 0.33 to 0.63 in 68 lifted walks of validation and training people, slow ones among
# them; 0.20 and more in runs. A leg that hangs and falls takes 0.7 to 0.8. With these limits none of 1,127 captured
# takes is doubted.
_QUICKEST, _SLOWEST = {"walk": 0.25, "run": 0.19}, 0.66
_USUAL = {"walk": 0.43, "run": 0.28}
# A stance is so many times as long as a swing: 1.39 and more in these walks. A foot is higher in a swing of a walk than
# in a stance by less than so many lengths of a leg, in a skip by more. Many runs are such too, but with knees bent:
# the straighter one has 33 degrees and more in captured runs forwards, 25 in the middle one of captured walks.
_WALKS, _LIFT, _STRAIGHT_DEG = 1.35, 0.15, 29.0
_REACH = (0.6, 1.25)  # lengths of a leg, that a foot goes: 0.6 to 1.17 in these takes, 1.5 on ladders
_STEP = 0.3  # the same, that a foot goes there and back at least
_UPRIGHT = 0.7  # cosine of the trunk
_EVEN = 1.35  # third over first quartile of these times
_FEWEST_ROWS = 4  # of a swing; quicker ones are noise
_FEWEST = 2  # swings, and stances, of both legs


def clock_doubts(level: PoseSequence) -> list[Notice]:
    """A notice where a body in the air, or the legs of a walk, are slower or faster than gravity makes them.

    level: as for `flown`, whose falls count where the path was measured; not filtered, for a filter takes the more of a
    movement the quicker its clock is.
    """
    fell = [flight.fall for flight in flown(level).flights] if level.measured_root is not None else []
    times = float(np.sqrt(np.median(fell) * _STATURE_M / GRAVITY)) if fell else 1.0  # as fast as it was
    movement = f"the body falls at {times**2:.2g} of gravity in the air"
    if 1 / _OFF < times < _OFF:
        swing_s, times = _swing(level)
        movement = f"the legs of a walk or run swing for {swing_s:.2f} s"
    if times == 1.0:
        return []
    way = "quickly" if times > 1 else "slowly"
    values = {"fps": level.fps, "movement": movement, "way": way, "fits": level.fps / times}
    return [notice("rate-against-movement", times=max(times, 1 / times), **values)]


def _swing(level: PoseSequence) -> tuple[float, float]:
    """Seconds in which a foot goes one way about the pelvis, higher than the other way, and how many times too quick
    that is, below 1 where too slow; 1 within what people do, and where legs do not swing evenly beneath an upright
    trunk."""
    none = np.nan, 1.0
    if len(level) < 2 or level.time_s is None:
        return none
    upright = unit((level.joint("thorax") - level.joint("pelvis")).astype(np.float64))[:, 2]
    upright = upright[np.isfinite(upright)]
    if not (len(upright) and np.median(upright) > _UPRIGHT):
        return none
    ways: dict[bool, list[tuple[float, float, float]]] = {True: [], False: []}  # to the front, or not
    hips, pelvis = level.joint("l_hip") - level.joint("r_hip"), level.joint("pelvis")
    with np.errstate(invalid="ignore", divide="ignore"):
        forward = unit(np.cross(hips, level.joint("thorax") - pelvis).astype(np.float64))
    knees_deg = []
    for side in "rl":
        chain = [level.joint(f"{side}_{part}").astype(np.float64) for part in ("hip", "knee", "ankle")]
        knees_deg.append(angle_deg(chain[1] - chain[0], chain[2] - chain[1]))
        length = sum(np.linalg.norm(b - a, axis=-1) for a, b in pairwise(chain))
        foot = (chain[-1] - pelvis) / np.nanmedian(length) if np.isfinite(length).any() else chain[-1]
        along = (foot * forward).sum(axis=-1)
        there = np.isfinite(along)
        along, height, time_s = along[there], foot[there, 2], level.times[there]
        for start, stop in pairwise(sorted(peaks(along, _STEP) + peaks(-along, _STEP))):
            lift = height[start : stop + 1].mean() - (height[start] + height[stop]) / 2
            reach = along[stop] - along[start]
            ways[bool(reach > 0)].append((time_s[stop] - time_s[start], abs(reach), lift))
    forth, back = (_whole(np.array(ways[way]).reshape(-1, 3)) for way in (True, False))
    if min(len(forth), len(back)) < _FEWEST:
        return none
    backwards = bool(np.median(forth[:, 2]) < np.median(back[:, 2]))
    swing, stance = (back, forth) if backwards else (forth, back)
    for each in (swing, stance):
        early, late = np.percentile(each[:, 0], [25, 75])
        if not late < _EVEN * early:
            return none
    (swing_s, reach, lift), (stance_s, _, below) = (np.median(each, axis=0) for each in (swing, stance))
    if not _REACH[0] < reach < _REACH[1] or swing_s * level.fps < _FEWEST_ROWS:
        return none
    knee_deg = float(np.nanmedian(np.fmin(*knees_deg)))
    walks = stance_s > _WALKS * swing_s and lift - below < _LIFT and not backwards
    return float(swing_s), _too_quick(float(swing_s), walks, knee_deg)


def _too_quick(swing_s: float, walks: bool, knee_deg: float) -> float:
    """How many times too quickly legs swing, of which the straighter knee bends by so much; 1 within what people do."""
    kind = "walk" if walks and knee_deg < _STRAIGHT_DEG else "run"
    if swing_s < _QUICKEST[kind]:
        return _USUAL[kind] / swing_s
    return _USUAL["walk"] / swing_s if walks and swing_s > _SLOWEST else 1.0


def _whole(halves: np.ndarray) -> np.ndarray:
    """Those of swings or stances (N, 3) in which the foot goes all its way, and the person has not stopped."""
    if not len(halves):
        return halves
    time_s, reach, _ = np.median(halves, axis=0)
    return halves[(halves[:, 0] < 2 * time_s) & (halves[:, 1] > reach / 2)]
