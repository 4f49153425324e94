"""What rises and returns in a signal: when each repetition begins, is highest and ends.

Nothing here looks across a clip boundary or a jump in time, and only repetitions across missing rows, few of them.
Times lie between rows where the signal says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...pipeline.signals.filters import BRIDGED_S, derivative, peaks, runs

# A repetition begins at _EDGE of its rise, or earlier: where the signal, below _LOW of the rise, is for the last time
# slower than _STARTS of its fastest. A lifter flattens slow starts, so that they reach a height late. Of labelled
# movements that were found, 97 % begin within 0.15 s of their label if captured and 83 % if lifted; by the height alone
# 94 and 79 %. If the signal is slow for longer than _RESTS_S after it has passed the height, and changes by less than
# _RESTS of the rise in that time, it rested: one low moment, as of a lifted knee in a walk, had set the height too low.
_RESTS_S, _RESTS = 0.5, 0.03
_EDGE = 0.07  # a steady return ends there too
_LOW, _STARTS = 0.12, 0.2
# It also ends where the return, below _LOW of the rise, slows to _SETTLED of its fastest: what follows is drift. At
# 0.15 of it lifted knees pause for a moment. On the labelled takes, lifted from nine cameras, 0.3 and 0.4 do alike.
_SETTLED = 0.3
# Of the rise: where one side of the peak rises by so much less than the other, the end of the visible part cuts it.
_OUTER = 0.1
# Missing rows inside a repetition: no more than a quarter of it, and less than the briefest labelled bends last.
_BRIDGED_S, _BRIDGED = 1.0, 0.25
_BACK = 0.2  # of the rise: a fall by more before the rise is another movement
_HELD = 0.85  # of the rise: what stays above is held
# At the top of a movement: longer, and it is a posture that somebody holds. Squats of the labelled takes stay 0.3 to
# 1.5 s below, arms with a box over the head 3.5.
_HOLD_S = 3.0
# Of its duration, or it is a slow movement: held arms of the labelled takes 0.5 to 0.6, a slow dancer's 0.2 to 0.37.
_HOLD = 0.4
_HIGH = 3  # rows above half of the rise: in fewer it is a slip of a detector
_FINE = 1001  # moments of a repetition: a duration of seconds to milliseconds


@dataclass(frozen=True)
class Repetition:
    """One rise and return of an angle. start_s, peak_s, stop_s: seconds. It begins at 7 % of the rise, or where the
    signal is last slow before, and ends at 7 %, or where the signal settles before. peak: the highest value, NaN where
    missing rows hide it. rise: its own, from the higher of the visible valleys beside it, where this movement begins or
    ends. seen: by how much it rises, and returns, in the visible part, from the lowest value on either side. held: from
    when to when the signal stays above 85 % of the rise. cut: whether an end of the take or a gap cuts its beginning,
    and its end."""

    start_s: float
    peak_s: float
    stop_s: float
    peak: float
    rise: float
    seen: tuple[float, float]
    held: tuple[float, float]
    cut: tuple[bool, bool] = (False, False)

    @property
    def whole(self) -> bool:
        """Whether all of it was seen."""
        return not any(self.cut) and bool(np.isfinite(self.peak))

    @property
    def held_s(self) -> float:
        """For how long."""
        return self.held[1] - self.held[0]

    @property
    def is_hold(self) -> bool:
        """Whether it is a posture that somebody holds, not a movement."""
        return self.held_s > max(_HOLD_S, _HOLD * (self.stop_s - self.start_s))


def repetitions(
    x: np.ndarray, time_s: np.ndarray, least: float, seams: Sequence[int] = ()
) -> list[Repetition]:
    """All rises of x (T,) by `least` or more between its missing rows, in order, also those whose beginning or end is
    not visible: outside the visible part x counts as low as its lowest value. A dip by less than `least` at the top
    does not end one. Up to a quarter of a repetition, and at most a second, may be missing."""
    has_value = np.isfinite(x)
    if not has_value.any():
        return []
    low = float(x[has_value].min())
    gaps = [gap for gap in _gaps(x, time_s, seams) if _lasts_s(gap, time_s) <= _BRIDGED_S]
    while True:
        filled = x.copy()
        for gap in gaps:
            filled[gap] = np.interp(time_s[gap], time_s[has_value], x[has_value])
        pieces = runs(np.isfinite(filled), time_s, seams)
        rises = [rise for rows in pieces for rise in _within(filled[rows], time_s[rows], least, low)]
        long = [gap for gap in gaps if any(_hides(gap, rise, time_s) for rise in rises)]
        if not long:
            return [_as_seen(rise, gaps, time_s) for rise in rises]
        gaps = [gap for gap in gaps if gap not in long]


def _gaps(x: np.ndarray, time_s: np.ndarray, seams: Sequence[int]) -> list[slice]:
    """The rows that x (T,) lacks between others of the same clip, where no rows are lacking."""
    result = []
    for clip in runs(np.ones(len(x), dtype=bool), time_s, seams):
        pieces = runs(np.isfinite(x[clip]), time_s[clip])
        result += [slice(clip.start + a.stop, clip.start + b.start) for a, b in pairwise(pieces)]
    return result


def _lasts_s(gap: slice, time_s: np.ndarray) -> float:
    return float(time_s[gap.stop] - time_s[gap.start - 1])


def _meets(gap: slice, start_s: float, stop_s: float, time_s: np.ndarray) -> bool:
    return bool(time_s[gap.start - 1] <= stop_s and start_s <= time_s[gap.stop])


def _hides(gap: slice, repetition: Repetition, time_s: np.ndarray) -> bool:
    """Whether too much of a repetition is missing there."""
    much = _lasts_s(gap, time_s) > _BRIDGED * (repetition.stop_s - repetition.start_s)
    return much and _meets(gap, repetition.start_s, repetition.stop_s, time_s)


def _as_seen(repetition: Repetition, gaps: Sequence[slice], time_s: np.ndarray) -> Repetition:
    """Without what missing rows in it hide."""

    def lacks(at_s: float) -> bool:
        return any(_meets(gap, at_s, at_s, time_s) for gap in gaps)

    cut = repetition.cut[0] or lacks(repetition.start_s), repetition.cut[1] or lacks(repetition.stop_s)
    return replace(repetition, peak=np.nan if lacks(repetition.peak_s) else repetition.peak, cut=cut)


def _within(values: np.ndarray, times: np.ndarray, least: float, low: float) -> list[Repetition]:
    """Those of an unbroken piece."""
    tops = [
        row - 1 for row in peaks(np.concatenate([[low], values, [low]]), least)
    ]  # as low before and behind
    edges = [0, *(int(a + np.argmin(values[a:b])) for a, b in pairwise(tops)), len(values) - 1]
    speed, rises = np.abs(derivative(values, times)), []
    for peak, first, last in zip(tops, edges, edges[1:], strict=False):
        if (values[first : last + 1] > values[peak] - least / 2).sum() < _HIGH:
            continue
        up, down = slice(first, peak + 1), slice(last, None if peak == 0 else peak - 1, -1)
        start_s, rise = _movement(values[up], times[up], speed[up])
        mirrored_s, fall = _movement(values[down], -times[down], speed[down], settles=True)
        visible_rise = float(values[peak] - values[up].min()), float(values[peak] - values[down].min())
        visible = [own for own, far in zip((rise, fall), visible_rise, strict=True) if far >= least]
        held = _held(values[first : last + 1], times[first : last + 1], peak - first, least)
        start_s, stop_s = min(start_s, held[0]), max(-mirrored_s, held[1])
        cut_start = first == 0 and start_s - times[0] <= BRIDGED_S and rise < (1 - _OUTER) * fall
        cut_stop = last == len(values) - 1 and times[-1] - stop_s <= BRIDGED_S and fall < (1 - _OUTER) * rise
        rises.append(
            Repetition(
                start_s, float(times[peak]), stop_s, float(values[peak]), min(visible, default=least),
                visible_rise, held, (cut_start or visible_rise[0] < least, cut_stop or visible_rise[1] < least),
            )
        )  # fmt: skip
    return rises


def _held(values: np.ndarray, times: np.ndarray, peak: int, least: float) -> tuple[float, float]:
    """From when to when values stay beyond _HELD of the rise to their peak, on each side from the lowest there; where a
    side was hardly seen, from that of the other."""
    sides = [values[: peak + 1].min(), values[peak:].min()]
    deep = [low for low in sides if values[peak] - low >= least] or [values[peak] - least]
    before, behind = (low if values[peak] - low >= least else min(deep) for low in sides)
    below = values[: peak + 1] <= before + _HELD * (values[peak] - before)
    beyond = values[peak:] <= behind + _HELD * (values[peak] - behind)
    first = int(np.flatnonzero(below)[-1]) if below.any() else 0
    last = peak + int(np.argmax(beyond)) if beyond.any() else len(values) - 1
    return float(times[first]), float(times[last])


def _movement(
    values: np.ndarray, times: np.ndarray, speed: np.ndarray, settles: bool = False
) -> tuple[float, float]:
    """Of a rise from its valley, the first row or later, to its peak, the last row: when it begins, and by how much it
    rises. settles: of a return, mirrored in time, which may end where it slows."""
    valley = _valley(values)
    values, times, speed = values[valley:], times[valley:], speed[valley:]
    rise = float(values[-1] - values[0])
    share = _SETTLED if settles else _STARTS
    slow = np.flatnonzero((values <= values[0] + _LOW * rise) & (speed <= share * speed.max()))
    start = float(times[slow[-1]] if len(slow) else times[0])
    edge = values[0] + _EDGE * rise
    row = int(np.flatnonzero(values <= edge)[-1])
    left = float(np.interp(edge, values[row : row + 2], times[row : row + 2]))  # for the last time
    before, then = np.interp([start - _RESTS_S, start], times, values)
    rests = start > left + _RESTS_S and then - before < _RESTS * rise
    return max(start, left) if settles or rests else min(start, left), rise


def _valley(values: np.ndarray) -> int:
    """The row from which values rise to their last without a fall by more than a fifth of the rise on the way up to
    half of it: what moves before is another movement."""
    rise = values[-1] - values.min()
    row = lowest = int(np.flatnonzero(values <= values.min() + rise / 2)[-1])
    while row > 0 and values[row] - values[lowest] <= _BACK * rise:
        row -= 1
        lowest = row if values[row] <= values[lowest] else lowest
    return lowest


def near_ends_s(x: np.ndarray, time_s: np.ndarray, repetition: Repetition, height: float) -> float:
    """Seconds of a repetition of x (T,) in which x is not yet `height` above where it begins, or no longer above where
    it ends: by so much the repetition would be shorter if it began and ended that much higher. NaN for no height."""
    if not np.isfinite(height):
        return float("nan")
    has_value = np.isfinite(x)
    at_s = np.linspace(repetition.start_s, repetition.stop_s, _FINE)
    values = np.interp(at_s, time_s[has_value], x[has_value])
    ends = np.where(at_s < repetition.peak_s, values[0], values[-1])
    return float((values < ends + height).mean() * (repetition.stop_s - repetition.start_s))
