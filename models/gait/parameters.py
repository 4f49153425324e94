"""Lengths, width and speed of a walk or a run, as gait laboratories report them beside the times (Gait.times).

Definitions: initial contact, toe-off, stance, swing, single and double support as in Perry & Burnfield, Gait Analysis,
2nd ed. 2010, chapter 1; steps, strides, speed and cadence as in Hollman, McDade & Petersen, Gait & Posture 34(1), 2011;
flight, and running as what has flights, as in Novacheck, Gait & Posture 7(1), 1998. A foot's place is its ankle's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...pipeline.core.rotations import unit
from ...pipeline.signals.filters import resample
from .contact import OTHER
from .gait import Gait, Stance, Step, Values, by_side, strides

_FLAT = (0.2, 0.6)  # of a stance: the foot lies flat and its ankle moves least
_FLAT_SAMPLES = 7
_WAY_SAMPLES = 25
_LONGEST_S = 0.8  # of a stance, for that: who stops moves the feet later
# Of the speed at which feet go back under the body: with less drift the person gets on over the floor, and the drift is
# the error of the path or the lift.
_CARRIED = 0.7
# The share of feet's ways in depth, and how many feet, that tell how far a walk in depth goes; how many times as far
# as these say is no lift's error. The paths of 19 lifted walks of 10 validation and training people are 1.2 times as
# far, with a standard deviation of 0.2 and at most 1.45; with 2.2 times their focal lengths 13 of 19 are told. Half of
# one makes paths no shorter than some are.
_IN_DEPTH, _FEWEST, _TOO_FAR = 0.7, 3, 1.75


def length_values(
    gait: Gait,
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    seams: Sequence[int] = (),
) -> Values:
    """{"step_length", "walking_speed": {side: (N,)}} of the steps that end when that foot lands, and {"stride_length",
    "step_width": {side: (M,)}} of that foot's strides, walk by walk, in the unit of the places; NaN where one is
    missing. root: (T, 2) the pelvis over the floor or the belt; ankles: (T, 2) by side relative to it.

    A foot's place is the mean over the part of its stance in which it lies flat, so that the noise of single frames
    does not enter. A stride's length is between two places of the same foot, a step's from the other foot's place to
    this one's, both along the way that the pelvis takes midway between them; a stride's width is how far to the side
    the other foot's place between lies from the middle of the two (in a straight walk that of Huxham et al., Gait &
    Posture 23(2), 2006). A step's speed is how far apart the pelvis is at its two landings by the mean time of all
    steps, so that the mean of speeds is distance by time.
    """
    stands = {side: places(root + ankles[side], time_s, gait.feet[side], seams) for side in "rl"}

    def at(side: str, start_s: float) -> np.ndarray:
        return stands[side].get(start_s, np.full(3, np.nan))

    landings = np.array([(step.start_s, step.stop_s) for step in gait.steps]).reshape(-1, 2)
    first, last = resample(root, time_s, landings.T.ravel(), seams).reshape(2, len(landings), -1)
    usual_s = float(np.mean(landings[:, 1] - landings[:, 0])) if len(landings) else float("nan")
    step_lengths, stride_lengths, widths = [], [], []
    for walk in gait.walks:
        ends = [(at(OTHER[step.side], step.start_s), at(step.side, step.stop_s)) for step in walk]
        step_lengths += [moved @ ahead for moved, ahead in _ways(root, time_s, walk, ends, seams)]
        of_walk = strides([walk], gait.feet)
        ends = [(at(s.side, s.start_s), at(s.side, s.stop_s)) for s in of_walk]
        ways = _ways(root, time_s, walk, ends, seams)
        for s, (before, after), (moved, ahead) in zip(of_walk, ends, ways, strict=True):
            aside = (at(OTHER[s.side], s.other_start_s) - (before + after) / 2)[:2] @ (-ahead[1], ahead[0])
            stride_lengths.append(moved @ ahead)
            widths.append(abs(aside))
    speeds = np.linalg.norm(last - first, axis=-1) / usual_s
    of_strides = {"stride_length": stride_lengths, "step_width": widths}
    return by_side(gait.steps, {"walking_speed": speeds, "step_length": step_lengths}) | by_side(
        gait.strides, of_strides
    )


def _ways(
    root: np.ndarray,
    time_s: np.ndarray,
    walk: Sequence[Step],
    ends: Sequence[tuple[np.ndarray, np.ndarray]],
    seams: Sequence[int],
) -> np.ndarray:
    """(N, 2, 2) of N pairs of places (x, y, time) in a walk: from one to the other, and the direction in which the
    pelvis goes midway, by a parabola through its path of three strides about that, as far as the walk goes: a bend is
    followed, swaying and the path's noise are not."""
    before, after = np.moveaxis(np.reshape(ends, (-1, 2, 3)), 1, 0)
    middle, reach = (before[:, 2] + after[:, 2]) / 2, 3 * (walk[-1].stop_s - walk[0].start_s) / len(walk)
    first = np.maximum(middle - reach, walk[0].start_s)
    last = np.minimum(middle + reach, np.maximum(walk[-1].stop_s, after[:, 2]))
    at_s = np.linspace(first, last, _WAY_SAMPLES, axis=1)
    ways, known = np.full((len(at_s), 2, 2), np.nan), np.flatnonzero(np.isfinite(middle))
    paths = resample(root, time_s, at_s[known].ravel(), seams).reshape(-1, _WAY_SAMPLES, 2)
    for i, path in zip(known, paths, strict=True):
        visible = np.isfinite(path).all(axis=1)
        if visible.sum() >= _WAY_SAMPLES / 2:
            ahead = np.polyfit(at_s[i, visible] - middle[i], path[visible], 2)[1]
            ways[i] = (after - before)[i, :2], unit(ahead)
    return ways


def over_belt(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    gait: Gait,
    seams: Sequence[int] = (),
) -> tuple[np.ndarray, float]:
    """((T, 2), belt speed): the pelvis as the belt of a treadmill sees it, and how fast the belt runs, by the drift of
    the feet that stand; the same path and 0 where they stay."""
    velocity = belt_drift(*standing(root, ankles, time_s, walked_on(gait), seams))
    return root - time_s[:, None] * velocity, float(np.linalg.norm(velocity))


def walked_on(gait: Gait) -> dict[str, list[Stance]]:
    """The stances that steps end with, by side."""
    landed = {(step.side, step.stop_s) for step in gait.steps}
    return {side: [s for s in gait.feet[side] if (side, s.start_s) in landed] for side in "rl"}


def standing(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    feet: Mapping[str, Sequence[Stance]],
    seams: Sequence[int] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 2) the velocities at which feet that lie flat are carried along, and (N, 2) go back under the body, of the
    stances that are seen whole. root, ankles: as of `length_values`."""
    velocities = []
    for side, of_side in feet.items():
        paths = np.hstack([root + ankles[side], ankles[side]])
        spans = np.reshape([(stance.start_s, stance.stop_s) for stance in of_side], (-1, 2))
        at_s = spans[:, :1] + np.array(_FLAT) * (spans[:, 1:] - spans[:, :1])
        at_s = at_s[np.isfinite(at_s).all(axis=1)]
        samples = resample(paths, time_s, at_s.ravel(), seams).reshape(-1, 2, 4)
        velocities += [*(samples[:, 1] - samples[:, 0]) / np.diff(at_s)]
    drifts, backs = np.split(np.reshape(velocities, (-1, 4)), 2, axis=1)
    whole = np.isfinite(drifts).all(axis=1)
    return drifts[whole], backs[whole]


def belt_drift(drifts: np.ndarray, backs: np.ndarray) -> np.ndarray:
    """(2,) the velocity at which feet that stand are carried along, the median of `standing` ones; zeros where most
    stay, drifting back by less than 0.7 of how fast they go back under the body, whichever way it walks. Feet that
    drift ahead are on no belt: their legs were lifted too short."""
    along = ((drifts - _CARRIED * backs) * backs).sum(axis=1)
    return np.median(drifts, axis=0) if len(along) and np.median(along) > 0 else np.zeros(2)


def times_too_far(drifts: np.ndarray, backs: np.ndarray, depth: np.ndarray) -> float:
    """How many times as far as `standing` feet go back under it the pelvis goes along depth (2,), the camera's view
    over the floor, for such feet stay where they are; 1 within what lifts are off, for few feet, and for a walk that is
    not mostly in depth."""
    path, steps = (drifts - backs) @ unit(depth), -backs @ unit(depth)
    in_depth = np.abs(steps).sum() > _IN_DEPTH * np.linalg.norm(backs, axis=1).sum()
    times = (path * steps).sum() / (steps**2).sum() if in_depth and len(steps) >= _FEWEST else 1.0
    return float(times) if times > _TOO_FAR else 1.0


def places(
    path: np.ndarray, time_s: np.ndarray, feet: Sequence[Stance], seams: Sequence[int]
) -> dict[float, np.ndarray]:
    """{initial contact: (D + 1,) the mean of path (T, D) over the part of a stance in which the foot lies flat, and the
    time of that}; a stance that is cut goes on to the take's end."""
    landed = [stance for stance in feet if stance.start_s == stance.start_s and stance.start_s < time_s[-1]]
    if not landed:
        return {}
    start = np.array([stance.start_s for stance in landed])
    stop = np.array([stance.stop_s if stance.stop_s == stance.stop_s else time_s[-1] for stance in landed])
    lasts = np.minimum(stop - start, _LONGEST_S)
    at_s = start[:, None] + np.linspace(*_FLAT, _FLAT_SAMPLES) * lasts[:, None]
    samples = resample(path, time_s, at_s.ravel(), seams).reshape(*at_s.shape, -1)
    means = np.column_stack([samples.mean(axis=1), at_s.mean(axis=1)])
    return {stance.start_s: mean for stance, mean in zip(landed, means, strict=True)}
