"""Repetitions of an angle as rows: how many, from when to when, how high, how smooth, and postures that are held."""

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
    numbered,
    text,
    within,
)
from ...pipeline.core.messages import spans_in_words
from ...pipeline.signals.angles import of_both
from ...pipeline.signals.filters import rate
from .columns import Columns
from .cycles import Repetition, comes_near, hiding, near_ends_s, repetitions, unreturned
from .figures import basis, middle, moments, spread, time_resolution, with_error
from .walking import FEWEST

_HALF = 0.5  # a repetition rises by this part of the largest change in the take
# Of the briefest repetition, for nobody repeats a movement to the frame: a gap that leaves room for a briefer one hides
# none. Of 63 series of lifted squats and raises this tells the seven that a gap made one short, and no other.
_AS_LONG = 0.8
# At the top of a movement: longer, and it is a posture that somebody holds. Squats of the labelled takes stay 0.3 to
# 1.5 s below, arms with a box over the head 3.5.
_HOLD_S = 3.0
_HIGH = 3  # frames in the upper half of a repetition that is no slip of a detector
_SLIPS = f"what is seen from {{}} lasts fewer than {_HIGH} frames"


def repeats(
    take: Columns,
    angle: str,
    driver: np.ndarray,
    sd: np.ndarray,
    least: float,
    shown: Iterable[str],
    counts: Callable[[Repetition], bool] = lambda one: True,
    briefest_s: float = 0.0,
) -> list[Row]:
    """Of the values (T,) of an angle that drives a movement, with their standard deviations (T,), and of those shown
    over the cycles of repetitions that count. briefest_s: where none is found, how long a gap hides one at least."""
    if np.isfinite(driver).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the angle"), *basis(driver)]
    slips = set[tuple[float, float]]()

    def stays(one: Repetition) -> bool:
        rows = slice(*np.searchsorted(take.times, [one.start_s, one.stop_s]).tolist())
        if np.isnan(one.peak) or (driver[rows] > one.peak - one.rise / 2).sum() >= _HIGH:
            return True
        slips.add((one.start_s, one.stop_s))
        return False

    usual = known_median(sd)
    noise = NOISE * usual if np.isfinite(usual) else 0.0
    asked, error = least, take.rise_error(angle, least, usual)
    least = max(least, noise)
    held = unreturned(driver, take.times, least, take.seams)
    among = max(least, _HALF * float(np.nanmax(driver) - np.nanmin(driver)))
    every = [one for one in repetitions(driver, take.times, among, take.seams) if counts(one) and stays(one)]
    holds = [one for one in [*every, *filter(counts, held)] if one.held_s > _HOLD_S]
    holds.sort(key=lambda one: one.start_s)
    found = [one for one in every if one.held_s <= _HOLD_S]
    others = [*every, *holds]
    # Of poses by the built-in lifter, or measured, a near miss beside others is none.
    near = (take.unstated_deg or not others) and comes_near(
        driver, take.times, asked, error, take.seams, counts, besides=others
    )
    which = "another" if others else "an"
    uncertain = f"it is uncertain whether {which} angle rises by {asked:g} degrees and comes back"
    if near and not others:
        return doubted([Measure("count", 0), Remark("reason", uncertain), *basis(driver)], slips, _SLIPS)
    whole_ones = [one for one in found if one.whole]
    if found:
        briefest_s = _AS_LONG * min(one.stop_s - one.start_s for one in whole_ones or found)
    gaps = hiding(driver, take.times, among, take.seams, briefest_s, counts)
    unseen = "count_reason" if found else "reason"
    said = [Remark(unseen, f"not seen from {spans_in_words(gaps)}")] if gaps else []
    # Of a part nobody knows how far it went: it may be of another like them, if it is none of theirs.
    first_s = float(take.times[np.flatnonzero(np.isfinite(driver))[0]])
    parts = [
        one.start_s if one.start_s == first_s else one.stop_s
        for one in held
        if one.held_s <= _HOLD_S
        and counts(one)
        and not any(whole.start_s <= one.peak_s <= whole.stop_s for whole in found)
    ]
    if parts and not gaps and (found or not holds):
        which = "another" if found else "one"
        said = [
            Remark(unseen, f"only part of {which} was seen, at {' and '.join(f'{at:.2f}' for at in parts)} s")
        ]
    if near and not said:
        said = [Remark(unseen, uncertain)]
    result = [Measure("count", len(found)), *said, *basis(driver), *_holds(holds)]
    return doubted([*result, *_figures(take, angle, driver, sd, found, shown)], slips, _SLIPS)


def _figures(
    take: Columns,
    angle: str,
    driver: np.ndarray,
    sd: np.ndarray,
    found: Sequence[Repetition],
    shown: Iterable[str],
) -> list[Row]:
    """When repetitions were and how high; of those seen whole also how long and how smooth. Arguments of `repeats`."""
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
    durations_s, frames_s = spans[:, 1] - spans[:, 0], time_resolution(rate(take.times))
    rises = np.array([one.rise for one in whole_ones])
    curves = (take.cycles(name, spans) for name in shown)
    return [
        *result,
        *spread("duration", "s", durations_s, frames_s, shared=ends_s),
        *spread("rise", "deg", rises, shared=height_sd),
        *_smoothness(whole_ones),
        Curves(tuple(curve for curve in curves if curve)),
    ]


def doubted(rows: Sequence[Row], spans: Collection[tuple[float, float]], why: str) -> list[Row]:
    """Rows of repetitions, with when there may be more of them, which are not counted. why: with {} for when."""
    if not spans:
        return list(rows)
    key = "count_reason" if numbered(grouped(rows), "peak") else "reason"
    said = "; ".join(filter(None, (text(grouped(rows), key), why.format(spans_in_words(sorted(spans))))))
    return [*(row for row in rows if not (isinstance(row, Remark) and row.name == key)), Remark(key, said)]


def _holds(held: Sequence[Repetition]) -> list[Row]:
    """Postures that are held: no repetitions of a movement, and in none of its means."""
    if not held:
        return []
    times: list[Row] = [
        moments("start", (one.start_s for one in held)),
        moments("stop", (one.stop_s for one in held)),
    ]
    longest = max(one.held_s for one in held)
    open_ended = any(not one.whole and one.held_s == longest for one in held)
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


def _smoothness(found: list[Repetition]) -> list[Measure]:
    result: list[Measure] = []
    for way in ("up", "down"):
        for i, name in enumerate(("sparc", "log_dimensionless_jerk")):
            values = np.array([getattr(one, way)[i] for one in found])
            result += middle(f"{name}_{way}", values[np.isfinite(values)])
    return result
