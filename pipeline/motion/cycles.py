"""What repeats in a signal: repetitions of an angle, steps, and curves over a cycle of 0 to 100 %.

Nothing here looks across a missing row, a clip boundary or a jump in time. Times lie between rows where the signal
says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .signals import derivative, rate, resample, runs
from .smoothness import log_dimensionless_jerk, sparc

POINTS = 101  # of a normalised cycle

_ENDS = 0.1  # of the rise: where a repetition begins and ends
_REST = 0.05  # of a movement's largest speed (Balasubramanian et al. 2015 cut movements so)
_CONFIRMED = 0.25  # of a least change: how far a foot goes back behind a landing next to a take's end
_BEYOND = 2.0  # standard deviations that this is too, or noise in standing makes a landing
_SIDEWAYS = (
    2.0  # times farther apart sideways than in front: feet of a straddle or a jumping jack, not of a step
)
_STEP_S = (0.25, 1.5)  # shorter or longer is no step of one walk


@dataclass(frozen=True)
class Repetition:
    """One rise and return. start_s, peak_s, stop_s: it begins and ends where a tenth of the rise lies below. peak: the
    signal's highest value. rise: from the higher of the two valleys beside it. up, down: smoothness of both movements,
    (SPARC, log dimensionless jerk) of the signal's rate, NaN when they are too short."""

    start_s: float
    peak_s: float
    stop_s: float
    peak: float
    rise: float
    up: tuple[float, float]
    down: tuple[float, float]


@dataclass(frozen=True)
class Step:
    """From one foot's landing to the other's. side: "r" or "l", the foot that lands at stop_s."""

    side: str
    start_s: float
    stop_s: float


def repetitions(
    x: np.ndarray, time_s: np.ndarray, least: float, seams: Sequence[int] = ()
) -> list[Repetition]:
    """The times that x (T,) rises by `least` or more and returns as far, in order.

    A rise without its return, or one that a gap cuts, is none; nor is a dip by less than `least` at the top.
    """
    found = []
    for piece in runs(np.isfinite(x), time_s, seams):
        values, times = x[piece], time_s[piece]
        speed = np.abs(derivative(values, times))
        peaks = [row for row, is_peak in _turns(values, least) if is_peak]
        edges = [0, *(a + int(np.argmin(values[a:b])) for a, b in pairwise(peaks)), len(values) - 1]
        for i, peak in enumerate(peaks):
            left, right = slice(edges[i], peak + 1), slice(peak, edges[i + 1] + 1)
            start, rise, up = _movement(values[left], times[left], speed[left])
            mirrored = values[right][::-1], -times[right][::-1], speed[right][::-1]
            stop, fall, down = _movement(*mirrored)
            found.append(
                Repetition(start, float(times[peak]), -stop, float(values[peak]), min(rise, fall), up, down)
            )
    return found


def steps(
    separation: np.ndarray,
    time_s: np.ndarray,
    least: float,
    seams: Sequence[int] = (),
    noise: float = 0.0,
    aside: np.ndarray | None = None,
) -> list[list[Step]]:
    """Walks, each a list of at least three steps in order.

    separation: (T,) how far the right ankle is in front of the left one, along the walking direction. A foot lands
    about when it is farthest in front, as in Zeni, Richards & Higginson, Gait & Posture 27(4), 2008 (who take it
    against the sacrum): its time is early or late by a part of a step that is the same for all, so that durations
    hold. least: by how much the separation changes from step to step at least; behind the last landing before an end
    it need not go back so far, or that landing would be lost with the step that the end cuts. noise: the separation's
    standard deviation, which it goes back by twice at least, or whoever stands still would land before the first step.
    aside: (T,) how far the right ankle is to the right of the left one: where that is twice as much as the separation,
    no foot lands in front of the other, and a walk ends.
    """
    confirmed = max(_CONFIRMED * least, _BEYOND * noise)
    walks: list[list[Step]] = []
    straddles = np.zeros(len(time_s), dtype=bool)
    if aside is not None:
        straddles = np.abs(aside) > _SIDEWAYS * np.abs(separation)
    for piece in runs(np.isfinite(separation), time_s, seams):
        values, times = separation[piece], time_s[piece]
        landings = [
            (
                _summit(values if is_peak else -values, times, row),
                "r" if is_peak else "l",
                straddles[piece][row],
            )
            for row, is_peak in _turns_and_ends(values, least, confirmed)
        ]
        walk: list[Step] = []
        for (start, _, wide), (stop, side, wide_too) in pairwise(landings):
            if _STEP_S[0] <= stop - start <= _STEP_S[1] and not wide and not wide_too:
                walk.append(Step(side, start, stop))
            else:
                walks.append(walk)
                walk = []
        walks.append(walk)
    return [walk for walk in walks if len(walk) >= 3]


def strides(walks: Sequence[Sequence[Step]], side: str) -> np.ndarray:
    """(N, 2) start and stop in seconds of one foot's cycles, from landing to landing."""
    spans = [(one.start_s, two.stop_s) for walk in walks for one, two in pairwise(walk) if two.side == side]
    return np.array(spans, dtype=np.float64).reshape(-1, 2)


def normalised(x: np.ndarray, time_s: np.ndarray, spans: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 101) x (T,) over each of the spans (N, 2), from 0 to 100 % of its duration; spans in which any of x is
    missing are left out."""
    at_s = np.linspace(spans[:, 0], spans[:, 1], POINTS, axis=-1)
    curves = resample(x, time_s, at_s.ravel(), seams).reshape(-1, POINTS)
    return curves[np.isfinite(curves).all(axis=1)]


def symmetry_index(right: float, left: float) -> float:
    """100 (right - left) / ((right + left) / 2) in per cent: 0 when equal, positive when the right is larger.

    Robinson, Herzog & Nigg, J Manipulative Physiol Ther 10(4), 1987.
    """
    return 100 * (right - left) / ((right + left) / 2) if right + left > 0 else float("nan")


def symmetry_error(right: float, left: float, right_error: float, left_error: float) -> float:
    """The index's standard error in per cent from those of both sides, which are taken for independent (first order);
    NaN where one is."""
    if not right + left > 0:
        return float("nan")
    return float(400 * np.hypot(left * right_error, right * left_error) / (right + left) ** 2)


def landings(walks: Sequence[Sequence[Step]], side: str) -> list[float]:
    """Seconds at which one foot lands: every step begins with a landing of the other foot and ends with one."""
    starts = [walk[0].start_s for walk in walks if walk and walk[0].side != side]
    return sorted({*starts, *(step.stop_s for walk in walks for step in walk if step.side == side)})


def _turns(values: np.ndarray, least: float) -> list[tuple[int, bool]]:
    """Rows of peaks (True) and valleys (False), alternating, between which values (T,) change by `least` or more; the
    change before the first and behind the last is as large too."""
    found: list[tuple[int, bool]] = []
    top = bottom = 0
    rising: bool | None = None
    for row, value in enumerate(values):
        top = row if value > values[top] else top
        bottom = row if value < values[bottom] else bottom
        if rising is not False and values[top] - value >= least:
            if rising:
                found.append((top, True))
            rising, bottom = False, row
        elif rising is not True and value - values[bottom] >= least:
            if rising is False:
                found.append((bottom, False))
            rising, top = True, row
    return found


def _turns_and_ends(values: np.ndarray, least: float, confirmed: float) -> list[tuple[int, bool]]:
    """The same, and one before and one behind them from which the values go back by `confirmed` only."""
    found = _turns(values, least)
    if not found:
        return found
    behind = _end(values, *found[-1], least, confirmed)
    before = _end(values[::-1], len(values) - 1 - found[0][0], found[0][1], least, confirmed)
    first = [] if before is None else [(len(values) - 1 - before, not found[0][1])]
    last = [] if behind is None else [(behind, not found[-1][1])]
    return [*first, *found, *last]


def _end(values: np.ndarray, turn: int, is_peak: bool, least: float, confirmed: float) -> int | None:
    """The row of the turn behind the last one that is certain, if the values end sooner behind it than the next turn
    would come: whoever stands still after a walk takes no step more."""
    rise = -values[turn:] if is_peak else values[turn:]
    top = int(np.argmax(rise))
    cut = len(rise) - top <= top
    certain = rise[top] - rise[0] >= least and rise[top] - rise[-1] >= confirmed
    return turn + top if cut and certain else None


def _movement(
    values: np.ndarray, times: np.ndarray, speed: np.ndarray
) -> tuple[float, float, tuple[float, float]]:
    """Of a rise from its valley, the first row or later, to its peak, the last row: when it begins, by how much it
    rises, and how smooth it is."""
    rise = float(values[-1] - values.min())
    low = values.min() + _ENDS * rise
    below = int(np.flatnonzero(values <= low)[-1])
    start = _crossing(values, times, below, low)
    high = below + int(np.argmax(values[below:] >= values[-1] - _ENDS * rise))
    # A pause on the way belongs to the movement; rest before a tenth of it and behind nine tenths does not.
    rest = _REST * speed[below : high + 1].max()
    before, behind = np.flatnonzero(speed[: below + 1] <= rest), np.flatnonzero(speed[high:] <= rest)
    first, last = times[0], times[-1]
    if len(before):
        first = _crossing(speed, times, before[-1], rest)
    if len(behind):
        last = _crossing(speed[::-1], times[::-1], len(speed) - 1 - high - behind[0], rest)
    even = np.linspace(first, last, round((last - first) * rate(times)) + 1)
    moving = resample(speed, times, even)
    fps = (len(even) - 1) / (last - first)
    return start, rise, (sparc(moving, fps), log_dimensionless_jerk(moving, fps))


def _crossing(values: np.ndarray, times: np.ndarray, row: int, level: float) -> float:
    """When values reach the level between a row that is not above it and the next, which is."""
    return float(np.interp(level, values[row : row + 2], times[row : row + 2]))


def _summit(values: np.ndarray, times: np.ndarray, peak: int) -> float:
    """When the parabola through a peak and its neighbours is highest."""
    t = times[peak - 1 : peak + 2] - times[peak]
    curve, slope, _ = np.polyfit(t, values[peak - 1 : peak + 2], 2)
    return float(times[peak] + (np.clip(-slope / (2 * curve), t[0], t[-1]) if curve < 0 else 0.0))
