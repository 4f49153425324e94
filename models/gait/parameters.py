"""What gait laboratories report of a walk or a run: times of the gait cycle, lengths, width, speed.

Definitions: initial contact, toe-off, stance, swing, single and double support as in Perry & Burnfield, Gait Analysis,
2nd ed. 2010, chapter 1; steps, strides, speed and cadence as in Hollman, McDade & Petersen, Gait & Posture 34(1), 2011;
flight, and running as what has flights, as in Novacheck, Gait & Posture 7(1), 1998. A foot's place is its ankle's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.motion.signals import resample
from ...pipeline.rotations import unit
from .events import Stance, Step, Stride

_OTHER = {"r": "l", "l": "r"}
_FLAT = (0.2, 0.6)  # of a stance: the foot lies flat and its ankle moves least
_FLAT_SAMPLES = 7
_BELT = 0.4  # leg lengths a second: a stance foot that drifts more is carried by a belt


@dataclass(frozen=True, eq=False)
class Times:
    """Of one side, in seconds; NaN where an event is not seen.

    step: (N,) of the steps that end when this foot lands. stride, stance, swing: (M,) of this foot's strides.
    first_support, last_support: (M,) from this foot's initial contact to the other's toe-off, and from the other's
    initial contact to this one's toe-off: double support where positive, flight where negative. single: (M,) the other
    foot's swing, when only this one bears the body; in a run, the stance.
    """

    step: np.ndarray
    stride: np.ndarray
    stance: np.ndarray
    swing: np.ndarray
    first_support: np.ndarray
    last_support: np.ndarray
    single: np.ndarray


def times(steps: Sequence[Step], strides: Sequence[Stride], side: str) -> Times:
    """The times of one side's steps and strides."""
    own = np.array(
        [
            (s.start_s, s.stop_s, s.off_s, s.other_off_s, s.other_start_s)
            for s in strides
            if s.side == side
        ],
        dtype=np.float64,
    ).reshape(-1, 5)
    start, stop, off, other_off, other_start = own.T
    first, last = other_off - start, off - other_start
    return Times(
        step=np.array([step.stop_s - step.start_s for step in steps if step.side == side], dtype=np.float64),
        stride=stop - start,
        stance=off - start,
        swing=stop - off,
        first_support=first,
        last_support=last,
        single=np.minimum(other_start, off) - np.maximum(other_off, start),
    )


@dataclass(frozen=True, eq=False)
class Lengths:
    """In the unit of the places. step: (N,) by side, of the steps that end when that foot lands; stride: (M,) of both
    feet's strides; width: (M,) of them. speed: (M,) of the pelvis over each stride. NaN where a place is missing."""

    step: dict[str, np.ndarray]
    stride: np.ndarray
    width: np.ndarray
    speed: np.ndarray


def lengths(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    steps: Sequence[Step],
    strides: Sequence[Stride],
    feet: Mapping[str, Sequence[Stance]],
    seams: Sequence[int] = (),
) -> Lengths:
    """Of steps and strides. root: (T, 2) the pelvis over the floor or the belt; ankles: (T, 2) by
    side, relative to it.

    A stride's length is between two places of the same foot, a step's from the other foot's place to this one's, along
    the way that the pelvis takes over the strides about it; its width is the distance of the place between from the
    line through a stride's two places (stride width of Huxham et al., Gait & Posture 23(2), 2006). Places are means
    over the part of the stance in which the foot lies flat, so that the noise of single frames does not enter. Speed is
    the pelvis's way in a straight line over a stride, by the time that it takes.
    """
    place = {side: _places(root + ankles[side], time_s, feet[side], seams) for side in "rl"}

    def at(side: str, start_s: float) -> np.ndarray:
        return place[side].get(start_s, np.full(2, np.nan))

    def way(start_s: float, stop_s: float) -> np.ndarray:
        both = resample(root, time_s, np.array([start_s, stop_s]), seams)
        return both[1] - both[0]

    ahead = {(s.side, s.stop_s): way(s.start_s, s.stop_s) for s in strides}
    ahead |= {(_OTHER[s.side], s.other_start_s): ahead[s.side, s.stop_s] for s in strides}
    step: dict[str, list[float]] = {side: [] for side in "rl"}
    for one in steps:
        moved = at(one.side, one.stop_s) - at(_OTHER[one.side], one.start_s)
        step[one.side].append(float(moved @ unit(ahead.get((one.side, one.stop_s), np.full(2, np.nan)))))
    stride, width, speed = [], [], []
    for s in strides:
        before, between, after = at(s.side, s.start_s), at(_OTHER[s.side], s.other_start_s), at(s.side, s.stop_s)
        along = after - before
        x, y = unit(along)
        stride.append(float(np.hypot(*along)))
        width.append(abs(float((between - before) @ (-y, x))))
        speed.append(float(np.hypot(*ahead[s.side, s.stop_s])) / (s.stop_s - s.start_s))
    return Lengths(
        {side: np.array(values) for side, values in step.items()}, np.array(stride), np.array(width), np.array(speed)
    )


def belt_drift(
    path: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    feet: Mapping[str, Sequence[Stance]],
    leg: float,
    seams: Sequence[int] = (),
) -> np.ndarray | None:
    """(2,) the velocity at which feet on the floor are carried along, the mean over the stances; None where they stay,
    which is below 0.4 lengths of a leg a second. path, ankles: as root and ankles of `lengths`."""
    drifts = []
    for side, stances in feet.items():
        for stance in stances:
            at_s = stance.start_s + np.array(_FLAT) * (stance.stop_s - stance.start_s)
            if np.isfinite(at_s).all():
                first, last = resample(path + ankles[side], time_s, at_s, seams)
                drifts.append((last - first) / (at_s[1] - at_s[0]))
    seen = np.array([drift for drift in drifts if np.isfinite(drift).all()])
    if not len(seen):
        return None
    drift = seen.mean(axis=0)
    return drift if np.hypot(*drift) > _BELT * leg else None


def _places(
    path: np.ndarray, time_s: np.ndarray, feet: Sequence[Stance], seams: Sequence[int]
) -> dict[float, np.ndarray]:
    """{initial contact: (2,) where the foot stands}; a stance that the take's end cuts goes on to there."""
    found = {}
    for stance in feet:
        stop = stance.stop_s if stance.stop_s == stance.stop_s else float(time_s[-1])
        if stance.start_s == stance.start_s and stop > stance.start_s:
            at_s = stance.start_s + np.linspace(*_FLAT, _FLAT_SAMPLES) * (stop - stance.start_s)
            found[stance.start_s] = resample(path, time_s, at_s, seams).mean(axis=0)
    return found
