"""What repeats in a signal: repetitions of an angle, and curves over a cycle of 0 to 100 %.

Nothing here looks across a clip boundary or a jump in time, and only repetitions across missing rows, few of them.
Times lie between rows where the signal says so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...pipeline.signals.angles import near
from ...pipeline.signals.filters import BRIDGED_S, derivative, rate, resample, runs

POINTS = 101  # of a normalised cycle

# A repetition begins at _EDGE of its rise, or earlier, where the rise below _LOW is slower than _STARTS of its
# fastest for the last time: a lifter flattens slow starts, so that they come late to a height. Of labelled movements
# that were found, 97 % begin within 0.15 s of their label if captured and 83 % if lifted, at the height alone 94 and
# 79 %. Where the signal is slow there so long after it has left the height, it rested: one low moment, as of a lifted
# knee in a walk, had set the height too low. In that time it changes by less than _RESTS of the rise.
_RESTS_S, _RESTS = 0.5, 0.03
_EDGE = 0.07  # a steady return ends there too
_LOW, _STARTS = 0.12, 0.2
# It has ended too where the return, below _LOW of the rise, slows to _SETTLED of its fastest: what follows is drift. At
# 0.15 of it lifted knees pause for a moment. On the labelled takes, lifted before nine cameras, 0.3 and 0.4 do alike.
_SETTLED = 0.3
_OUTER = 0.1  # of the rise: by so much less on one side of the peak, and the end of a take cuts it there
# Missing rows inside a repetition: no more than a quarter of it, and less than the briefest labelled bends last. The
# signal has risen before them and returns behind, so that it is one at least.
_BRIDGED_S, _BRIDGED = 1.0, 0.25
_BACK = 0.2  # of the rise: a fall by more before the rise is another movement
_HELD = 0.85  # of the rise: what stays above is held
_LEAST = 0.1  # of what a repetition rises by: less is no candidate, however large the error
_LONG_S = 60.0  # a hole in the time stamps may last for days
_FINE = 1001  # moments of a repetition: a duration of seconds to milliseconds
_PADDED = 4  # rows of rest beside the rows that were seen


@dataclass(frozen=True)
class Repetition:
    """One rise and return. start_s, peak_s, stop_s: it begins at 7 % of the rise, or where the signal is last slow
    before, and ends at 7 %, or where the signal settles before. peak: the signal's highest value, NaN where missing
    rows hide it. rise: from the higher of the two valleys beside it, where this movement begins or ends (`_valley`); it
    may be less than `least`, which counts from the lowest. whole: False where a gap hides how it began, how high it
    came or how it ended, so that all of these but the peak are of a part. cut: whether a clip, or what is seen of it,
    begins in it, and ends in it. held: from when to when the signal stays beyond _HELD of the rise."""

    start_s: float
    peak_s: float
    stop_s: float
    peak: float
    rise: float
    whole: bool = True
    held: tuple[float, float] = (0.0, 0.0)
    cut: tuple[bool, bool] = (False, False)

    @property
    def held_s(self) -> float:
        """For how long."""
        return self.held[1] - self.held[0]


def repetitions(
    x: np.ndarray, time_s: np.ndarray, least: float, seams: Sequence[int] = ()
) -> list[Repetition]:
    """The times that x (T,) rises by `least` or more and returns as far, in order.

    A rise without its return, or one that a long gap cuts, is none; nor is a dip by less than `least` at the top. Up to
    a quarter of a repetition, and a second, may be missing: what was seen rises and returns by `least` then. One beside
    a longer gap, which hides the rest of it, is not `whole`.
    """
    bridged = [gap for gap in _gaps(x, time_s, seams) if _lasts(gap, time_s) <= _BRIDGED_S]
    while True:
        found = _unbroken(_filled(x, time_s, bridged), time_s, least, seams)
        long = [gap for gap in bridged if any(_cuts(gap, one, time_s) for one in found)]
        if not long:
            return [_as_seen(one, bridged, time_s) for one in found]
        bridged = [gap for gap in bridged if gap not in long]


def _gaps(x: np.ndarray, time_s: np.ndarray, seams: Sequence[int]) -> list[slice]:
    """The rows that x (T,) lacks between others of the same clip, where no rows are lacking."""
    result = []
    for clip in runs(np.ones(len(x), dtype=bool), time_s, seams):
        pieces = runs(np.isfinite(x[clip]), time_s[clip])
        result += [slice(clip.start + a.stop, clip.start + b.start) for a, b in pairwise(pieces)]
    return result


def _lasts(gap: slice, time_s: np.ndarray) -> float:
    return float(time_s[gap.stop] - time_s[gap.start - 1])


def _filled(x: np.ndarray, time_s: np.ndarray, gaps: Sequence[slice]) -> np.ndarray:
    """x (T,) with straight lines across gaps: what rises and returns on them does so in what was seen."""
    filled, known = x.copy(), np.isfinite(x)
    for gap in gaps:
        filled[gap] = np.interp(time_s[gap], time_s[known], x[known])
    return filled


def _meets(gap: slice, start_s: float, stop_s: float, time_s: np.ndarray) -> bool:
    return bool(time_s[gap.start - 1] <= stop_s and start_s <= time_s[gap.stop])


def _cuts(gap: slice, one: Repetition, time_s: np.ndarray) -> bool:
    """Whether too much of a repetition is missing there."""
    much = _lasts(gap, time_s) > _BRIDGED * (one.stop_s - one.start_s)
    return much and _meets(gap, one.start_s, one.stop_s, time_s)


def _as_seen(one: Repetition, gaps: Sequence[slice], time_s: np.ndarray) -> Repetition:
    """Without what missing rows hide."""

    def lacks(start_s: float, stop_s: float) -> bool:
        return any(_meets(gap, start_s, stop_s, time_s) for gap in gaps)

    start_s, peak_s, stop_s = one.start_s, one.peak_s, one.stop_s
    return replace(
        one,
        peak=np.nan if lacks(peak_s, peak_s) else one.peak,
        whole=one.whole and not any(lacks(at_s, at_s) for at_s in (start_s, peak_s, stop_s)),
    )


def _unbroken(x: np.ndarray, time_s: np.ndarray, least: float, seams: Sequence[int]) -> list[Repetition]:
    """`repetitions` that lack no row."""
    found = []
    pieces = runs(np.isfinite(x), time_s, seams)
    for piece in pieces:
        values, times = x[piece], time_s[piece]
        speed = np.abs(derivative(values, times))
        peaks = [row for row, is_peak in _turns(values, least) if is_peak]
        edges = [0, *(a + int(np.argmin(values[a:b])) for a, b in pairwise(peaks)), len(values) - 1]
        for i, peak in enumerate(peaks):
            left, right = slice(edges[i], peak + 1), slice(peak, edges[i + 1] + 1)
            start, rise = _movement(values[left], times[left], speed[left])
            mirrored = values[right][::-1], -times[right][::-1], speed[right][::-1]
            stop, fall = _movement(*mirrored, settles=True)
            begun = i == 0 and start - times[0] <= BRIDGED_S and rise < (1 - _OUTER) * fall
            goes_on = peak == peaks[-1] and times[-1] + stop <= BRIDGED_S and fall < (1 - _OUTER) * rise
            found.append(
                Repetition(
                    start, float(times[peak]), -stop, float(values[peak]), min(rise, fall),
                    whole=not (begun or goes_on), held=_held(values[left], times[left], values[right], times[right]),
                    cut=(begun, goes_on),
                )
            )  # fmt: skip
    return found


def _held(up: np.ndarray, up_s: np.ndarray, down: np.ndarray, down_s: np.ndarray) -> tuple[float, float]:
    """When a rise comes to _HELD of its height, and when the return leaves that."""
    first = int(np.flatnonzero(up <= up.min() + _HELD * (up[-1] - up.min()))[-1])
    last = int(np.argmax(down <= down.min() + _HELD * (down[0] - down.min())))
    return float(up_s[first]), float(down_s[last])


def unreturned(
    x: np.ndarray, time_s: np.ndarray, least: float, seams: Sequence[int] = ()
) -> list[Repetition]:
    """Rises of x (T,) by `least` or more that last when x is seen for the last time, or have begun before it is seen
    for the first time. None is `whole`: the end that was not seen is where x ends, and so is that of `held`."""
    known = np.flatnonzero(np.isfinite(x))
    if len(known) < 2:
        return []
    first, last = int(known[0]), int(known[-1])
    apart = np.arange(1, _PADDED + 1) / rate(time_s)
    times = np.concatenate([time_s[first] - apart[::-1], time_s[first : last + 1], time_s[last] + apart])
    low = np.full(_PADDED, x[known].min())
    padded = np.concatenate([low, x[first : last + 1], low])
    cuts = [seam - first + _PADDED for seam in seams if first < seam <= last]
    within_s = (float(time_s[first]), float(time_s[last]))
    return [
        replace(
            one,
            start_s=max(one.start_s, within_s[0]), stop_s=min(one.stop_s, within_s[1]),
            held=(max(one.held[0], within_s[0]), min(one.held[1], within_s[1])),
            whole=False, cut=(one.start_s < within_s[0], one.stop_s > within_s[1]),
        )
        for one in repetitions(padded, times, least, cuts)
        if one.start_s < within_s[0] or one.stop_s > within_s[1]
    ]  # fmt: skip


def comes_near(
    x: np.ndarray,
    time_s: np.ndarray,
    least: float,
    error: float,
    seams: Sequence[int] = (),
    counts: Callable[[Repetition], bool] = lambda one: True,
    cut: bool = True,
    besides: Sequence[Repetition] = (),
) -> list[Repetition]:
    """Where x (T,) rises and returns by `least` but for its error, half the width of a 90 % bar: where no repetition
    is found then, nobody can say that there was none. cut: one that is only seen in part counts too. besides: others
    that do not count."""
    least = max(least - error, _LEAST * least)
    near = [*repetitions(x, time_s, least, seams), *(unreturned(x, time_s, least, seams) if cut else ())]
    return [
        one for one in near if counts(one) and not any(a.start_s < one.peak_s < a.stop_s for a in besides)
    ]


def hiding(
    x: np.ndarray,
    time_s: np.ndarray,
    least: float,
    seams: Sequence[int] = (),
    briefest_s: float = 0.0,
    counts: Callable[[Repetition], bool] = lambda one: True,
) -> list[tuple[float, float]]:
    """The gaps of x (T,), (begin, end) in seconds of the rows beside each, that may have kept `repetitions` from
    finding one: with x at its highest in all gaps there is one across it, which lasts briefest_s or longer, and counts.
    x that has not risen by `least` may be so much higher there. The time before x is first seen and that after it is
    last seen are gaps too, if they last for half of briefest_s: in less nothing rises or returns. A gap that lasts for
    all of it may have one of its own, whatever was seen beside it. In one of more than a minute there may be any.
    """
    known, step = np.isfinite(x), 1 / rate(time_s)
    if not known.any():
        return []
    gaps = [
        (float(time_s[a.stop - 1]), float(time_s[b.start]))
        for a, b in pairwise(runs(known, time_s, seams))
        if time_s[b.start] - time_s[a.stop - 1] > 1.5 * step  # a clip boundary lacks no row
    ]
    first, last = (float(time_s[row]) for row in np.flatnonzero(known)[[0, -1]])
    begins, ends, return_s = float(time_s[0]), float(time_s[-1]), max(briefest_s / 2, step / 2)
    gaps = [
        *[(begins, first)] * (first - begins > return_s),
        *gaps,
        *[(last, ends)] * (ends - last > return_s),
    ]
    if not gaps:
        return []
    long = [(begin, end) for begin, end in gaps if end - begin > _LONG_S]
    short = [gap for gap in gaps if gap not in long]
    lowest, highest = float(x[known].min()), float(x[known].max())
    highest += 0.0 if highest - lowest >= least else least
    inside = np.concatenate([np.zeros(0), *(np.arange(a + step, b - step / 2, step) for a, b in short)])
    outer = [at for at, gap in ((begins, (begins, first)), (ends, (last, ends))) if gap in short]
    times = np.concatenate([time_s[known], inside, outer])
    values = np.concatenate([x[known], np.full(len(inside), highest), np.full(len(outer), lowest)])
    order = np.argsort(times, kind="stable")
    cuts = np.searchsorted(times[order], time_s[list(seams)])
    own = [
        Repetition(begin + step / 2, (begin + end) / 2, end - step / 2, np.nan, np.nan, whole=False)
        for begin, end in short
        if 0 < briefest_s <= end - begin - step
    ]
    each = [*repetitions(values[order], times[order], least, cuts.tolist()), *own]
    found = [one for one in each if counts(one)]
    across = [(one.start_s, one.stop_s) for one in found if one.stop_s - one.start_s >= briefest_s]
    within = [(one.start_s, one.stop_s) for one in repetitions(x, time_s, least, seams)]
    # What was seen beside a brief gap rises and returns, and the gap is too much of that: so it may be briefer.
    lines = _filled(x, time_s, [gap for gap in _gaps(x, time_s, seams) if _lasts(gap, time_s) <= _BRIDGED_S])
    across += [
        (one.start_s, one.stop_s)
        for one in _unbroken(lines, time_s, least, seams)
        if counts(one) and not any(a <= one.peak_s <= b for a, b in within)
    ]
    return [
        (begin, end)
        for begin, end in gaps
        if (begin, end) in long
        or (
            any(a < end and begin < b for a, b in across)
            and not any(a <= begin and end <= b for a, b in within)
        )
    ]


def near_ends_s(x: np.ndarray, time_s: np.ndarray, one: Repetition, height: float) -> float:
    """Seconds of a repetition of x (T,) in which x is not yet `height` above where it begins, or no longer above where
    it ends: by so much the repetition would be shorter if it began and ended that much higher. NaN for no height."""
    if not np.isfinite(height):
        return float("nan")
    at_s = np.linspace(one.start_s, one.stop_s, _FINE)
    values = np.interp(at_s, time_s, x)
    ends = np.where(at_s < one.peak_s, values[0], values[-1])
    return float((values < ends + height).mean() * (one.stop_s - one.start_s))


def normalised(x: np.ndarray, time_s: np.ndarray, spans: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 101) x (T,) over each of the spans (N, 2), from 0 to 100 % of its duration; spans in which any of x is
    missing are left out. An angle goes through `unwrapped` before and `alike` afterwards."""
    at_s = np.linspace(spans[:, 0], spans[:, 1], POINTS, axis=-1)
    curves = resample(x, time_s, at_s.ravel(), seams).reshape(-1, POINTS)
    return curves[np.isfinite(curves).all(axis=1)]


def alike(curves_deg: np.ndarray, centre_deg: float) -> np.ndarray:
    """Curves (N, K) of an angle, each moved by whole turns: the first begins within 180 degrees of centre_deg, the
    others within 180 degrees of where it begins."""
    begins = curves_deg[:, :1]
    return curves_deg + near(begins, near(begins[:1], centre_deg)) - begins


def symmetry_index(right: float, left: float) -> float:
    """100 (right - left) / ((right + left) / 2) in per cent: 0 when equal, positive when the right is larger.

    Robinson, Herzog & Nigg, J Manipulative Physiol Ther 10(4), 1987.
    """
    return 100 * (right - left) / ((right + left) / 2) if right + left > 0 else float("nan")


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
    left = _crossing(values, times, int(np.flatnonzero(values <= edge)[-1]), edge)  # for the last time
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


def _crossing(values: np.ndarray, times: np.ndarray, row: int, level: float) -> float:
    """When values reach the level between a row that is not above it and the next, which is."""
    return float(np.interp(level, values[row : row + 2], times[row : row + 2]))
