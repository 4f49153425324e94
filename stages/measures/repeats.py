"""Repetitions of an angle as rows: how many, from when to when, how high, and postures that are held."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...models.angle_error.repeatability import known_median
from ...models.gait.of_take import NOISE
from ...pipeline.core.measures import (
    SD_90,
    Curves,
    Measure,
    Remark,
    Row,
    grouped,
    text,
    value,
    within,
)
from ...pipeline.core.messages import spans_in_words
from ...pipeline.signals.angles import of_both
from ...pipeline.signals.filters import BRIDGED_S, rate
from .columns import Columns
from .cycles import Repetition, comes_near, hiding, near_ends_s, repetitions, unreturned
from .figures import basis, moments, spread, time_resolution, with_error
from .walking import FEWEST

# Of the briefest repetition, for nobody repeats a movement to the frame: a gap that leaves room for a briefer one hides
# none. Of 63 series of lifted squats and raises this tells the seven that a gap made one short, and no other.
_AS_LONG = 0.8
# At the top of a movement: longer, and it is a posture that somebody holds. Squats of the labelled takes stay 0.3 to
# 1.5 s below, arms with a box over the head 3.5.
_HOLD_S = 3.0
# Of its duration, or it is a slow movement: held arms of the labelled takes 0.5 to 0.6, a slow dancer's 0.2 to 0.37.
_HOLD = 0.4
_HIGH = 3  # frames in the upper half of a repetition that is no slip of a detector
# Standard deviation of one lifted duration, however steeply the angle rises and returns: a few degrees decide whether a
# swing before a raise belongs to it. Of 208 raises of validation people two in three are off by less.
_EACH_S = 0.15
# Share of the threshold that a repetition's own rise (Repetition.rise) must reach, or it is uncertain. Of 900 lifted
# ones of validation people 25 rise by less, and none of these by enough in the capture; 55 rise by 0.8 to 1 of it, of
# which 15 rise by enough in the capture and 31 by five sixths of it.
_OWN = 0.8
_NEARLY = 0.9  # share of the threshold, or of its highest: moments that show that it rises, or comes back
COUNTS, OTHER = "", "another movement"
_SLIPS = f"what is seen from {{}} lasts fewer than {_HIGH} frames"
_VAGUE = "what is seen from {} may not rise and come back: the angle is too uncertain"


def repeats(
    take: Columns,
    angle: str,
    driver: np.ndarray,
    sd: np.ndarray,
    least: float,
    shown: Iterable[str],
    judged: Callable[[Repetition], str] = lambda one: COUNTS,
    briefest_s: float = 0.0,
    share: float = 0.0,
    unsure: np.ndarray | None = None,
    doubts: dict[str, set[tuple[float, float]]] | None = None,
) -> list[Row]:
    """Of the values (T,) of an angle that drives a movement, with their standard deviations (T,), and of those shown
    over the cycles of repetitions that count. judged: COUNTS, OTHER where it is another movement, or why it may be
    none, with {} for when. briefest_s: where none is found, how long a gap hides one at least. share: of the largest
    change in the take, by which one rises at least. unsure: (T,) when nobody knows how high the angle is; judged says
    what counts of that. doubts: filled with (begin, end) of what may be none, by why."""
    if np.isfinite(driver).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the angle"), *basis(driver)]
    sure = np.isfinite(driver) & (True if unsure is None else ~unsure)
    first_s, last_s = take.times[np.flatnonzero(sure if sure.any() else np.isfinite(driver))[[0, -1]]]

    def may_be(one: Repetition) -> bool:
        return judged(one) != OTHER

    def slips(one: Repetition) -> str:
        rows = slice(*np.searchsorted(take.times, [one.start_s, one.stop_s]).tolist())
        few = np.isfinite(one.peak) and (driver[rows] > one.peak - one.rise / 2).sum() < _HIGH
        return _SLIPS * bool(few)

    def vague(one: Repetition) -> str:
        """Whether it rises, or comes back, only in moments whose own noise is as large."""
        start, peak, stop = np.searchsorted(take.times, [one.start_s, one.peak_s, one.stop_s])
        sides = slice(max(start - 1, 0), peak + 1), slice(peak, stop + 1)
        highest = np.nanmax(driver[sides[0].start : sides[1].stop], initial=-np.inf)
        for rows in sides:
            falls = np.nan_to_num(highest - driver[rows])
            shows = falls >= _NEARLY * min(asked, falls.max())
            if not (falls[shows] >= np.nan_to_num(NOISE * sd[rows][shows])).any():
                return _VAGUE
        return ""

    def seen(one: Repetition) -> Repetition:
        """Without what nobody knows of it, before, behind and at its highest."""
        if unsure is None:
            return one
        cut = one.cut[0] or one.start_s < first_s, one.cut[1] or one.stop_s > last_s
        one = replace(one, cut=cut, whole=one.whole and not any(cut))
        if not unsure[take.times.searchsorted(one.peak_s)]:
            return one
        return replace(one, peak=np.nan, whole=False)

    usual = known_median(sd)
    noise = NOISE * usual if np.isfinite(usual) else 0.0
    asked, error = least, take.rise_error(angle, least, usual)
    least = max(least, noise)
    among = max(least, share * float(np.nanmax(driver) - np.nanmin(driver)))
    told = [
        (one, judged(one) or slips(one) or vague(one))
        for one in repetitions(driver, take.times, among, take.seams)
        if any(one.cut) or one.rise >= _OWN * asked
    ]
    every = [seen(one) for one, why in told if why == COUNTS]
    cut = [
        (one, judged(one)) for one in unreturned(driver, take.times, least, take.seams) if not _in(one, every)
    ]
    told += cut
    seen_in_part = [one for one, why in cut if why == COUNTS]
    held = sorted(filter(_is_held, [*every, *seen_in_part]), key=lambda one: one.start_s)
    found = [one for one in every if not _is_held(one)]
    # Of a part nobody knows how far it went: it may be of another like those found.
    parts = [one for one in seen_in_part if not _is_held(one)]
    others = [*every, *held, *parts]
    # Of poses by the built-in lifter, or measured, a near miss beside others is none.
    error = 0.0 if others and take.judged else error
    besides = [*others, *(one for one, why in told if why not in (COUNTS, OTHER))]
    near = comes_near(driver, take.times, asked, error, take.seams, may_be, besides=besides)
    uncertain = any(judged(one) == COUNTS for one in near)
    whole_ones = [one for one in found if one.whole]
    if found:
        briefest_s = _AS_LONG * min(one.stop_s - one.start_s for one in whole_ones or found)
    gaps = hiding(driver, take.times, among, take.seams, briefest_s, may_be)
    why = []
    if gaps and (others or not near):
        why = [f"the angle is not known from {spans_in_words(gaps)}"]
    elif found or not held:
        why = _in_part(first_s, last_s, found, parts)
    if not why and uncertain:
        again = " once more" * bool(others)
        why = [f"it is uncertain whether the angle rises by {asked:g} degrees{again} and comes back"]
    unseen = "count_reason" if found else "reason"
    said = [Remark(unseen, "; ".join(why))] if why else []
    rows: list[Row] = [Measure("count", len(found)), *said, *basis(driver), *holds(held)]
    rows += _figures(take, angle, driver, sd, found, shown)
    doubts = {} if doubts is None else doubts
    for one, why_none in told:
        if why_none not in (COUNTS, OTHER) and not _in(one, every):
            doubts.setdefault(why_none, set()).add((one.start_s, one.stop_s))
    for why_none, spans in doubts.items():
        rows = doubted(rows, spans, why_none)
    return rows


def _is_held(one: Repetition) -> bool:
    return one.held_s > max(_HOLD_S, _HOLD * (one.stop_s - one.start_s))


def _in(one: Repetition, others: Sequence[Repetition]) -> bool:
    """Whether its highest lies in another."""
    return any(each.start_s <= one.peak_s <= each.stop_s for each in others)


def _in_part(
    first_s: float, last_s: float, found: Sequence[Repetition], parts: Sequence[Repetition]
) -> list[str]:
    """What is said of repetitions that begin before first_s, when the angle is sure for the first time, or end behind
    last_s: of those found, and of others, `parts`."""

    def at(of: Sequence[Repetition]) -> list[float]:
        begun = any(one.cut[0] and one.start_s - first_s <= BRIDGED_S for one in of)
        goes_on = any(one.cut[1] and last_s - one.stop_s <= BRIDGED_S for one in of)
        return [float(first_s)] * begun + [float(last_s)] * goes_on

    return [
        f"only part of {which} was seen, at {' and '.join(f'{at_s:.2f}' for at_s in when)} s"
        for which, when in (("one", at(found)), ("another" if found else "one", at(parts)))
        if when
    ]


def _figures(
    take: Columns,
    angle: str,
    driver: np.ndarray,
    sd: np.ndarray,
    found: Sequence[Repetition],
    shown: Iterable[str],
) -> list[Row]:
    """When repetitions were and how high; of those seen whole also how long. Arguments of `repeats`."""
    if not found:
        return []
    result: list[Row] = [
        moments("start", (one.start_s for one in found)),
        moments("stop", (one.stop_s for one in found)),
        moments("peak_at", (one.peak_s for one in found)),
        *_peaks(take, angle, found, sd),
    ]
    if not (whole_ones := [one for one in found if one.whole]):
        return result
    usual = known_median(sd)
    spans = np.array([(one.start_s, one.stop_s) for one in whole_ones])
    # Of a height above the valley, as of the whole rise. What a lifter has wrong of the posture in which a repetition
    # begins it has wrong of the same one at its end and in the next, so that all are too long, or all too short.
    height_sd = np.sqrt(2) * (usual if np.isfinite(usual) else take.unknown)
    ends_s = float(np.mean([near_ends_s(driver, take.times, one, height_sd) for one in whole_ones]))
    durations_s, each_s = spans[:, 1] - spans[:, 0], time_resolution(rate(take.times))
    each_s = float(np.hypot(each_s, _EACH_S)) if np.isfinite(usual) else each_s
    rises = np.array([one.rise for one in whole_ones])
    curves = (take.cycles(name, spans) for name in shown)
    return [
        *result,
        *spread("duration", "s", durations_s, each_s, shared=ends_s),
        *spread("rise", "deg", rises, shared=height_sd),
        Curves(tuple(curve for curve in curves if curve)),
    ]


def doubted(rows: Sequence[Row], spans: Collection[tuple[float, float]], why: str) -> list[Row]:
    """Rows of repetitions, with when there may be more of them, which are not counted. why: with {} for when."""
    if not spans:
        return list(rows)
    key = "count_reason" if value(grouped(rows), "count") else "reason"
    said = "; ".join(filter(None, (text(grouped(rows), key), why.format(spans_in_words(sorted(spans))))))
    return [*(row for row in rows if not (isinstance(row, Remark) and row.name == key)), Remark(key, said)]


def holds(held: Sequence[Repetition]) -> list[Row]:
    """Postures that are held: no repetitions of a movement, and in none of its means."""
    if not held:
        return []
    times: list[Row] = [
        moments("start", (one.held[0] for one in held)),
        moments("stop", (one.held[1] for one in held)),
    ]
    longest = max(one.held_s for one in held)
    open_ended = any(any(one.cut) and one.held_s == longest for one in held)
    lasts: list[Row] = [Measure("longest", float(longest), "s")]
    lasts += [Remark("longest_reason", "how it begins or ends was not seen")] if open_ended else []
    return within("holds", [Measure("count", len(held)), *times, *lasts])


def _peaks(take: Columns, angle: str, found: Sequence[Repetition], sd: np.ndarray) -> list[Measure]:
    """Those that were seen, with their errors, if all have one; then the minimal detectable change."""
    seen = [i for i, one in enumerate(found) if np.isfinite(one.peak)]
    errors = [float(sd[np.searchsorted(take.times, found[i].peak_s)]) for i in seen]
    peaks = [with_error("peak", "deg", found[i].peak, error) for i, error in zip(seen, errors, strict=True)]
    known = bool(np.isfinite(errors).all())
    usual = known_median(np.array(errors))
    mdc90 = SD_90 * take.difference_sd(f"peak.{of_both(angle)}", (usual, usual), "repetitions")
    return [
        *(
            replace(one, number=i, error=one.error if known else None)
            for i, one in zip(seen, peaks, strict=True)
        ),
        *([Measure("peak_mdc90", mdc90, "deg")] if known and len(peaks) > 1 else []),
    ]
