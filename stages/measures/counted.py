"""Repetitions as rows: how many, from when to when and how high."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from ...models.common.motion import Motion
from ...pipeline.core.measures import SD_90, Measure, Row, Side, side_of, within
from ...pipeline.core.rotations import known_median
from ...pipeline.signals.angles import of_both
from ...pipeline.signals.filters import rate
from .cycles import mean_curve
from .figures import (
    error_of_difference,
    moments,
    observable,
    spread,
    unknown_deg,
    unstated_deg,
    with_error,
)
from .movements import SQUAT, Counted
from .repetitions import Repetition, near_ends_s

# Standard deviation of one lifted duration, however steeply the angle rises and returns: a few degrees decide whether a
# swing before a raise belongs to it. Of 208 raises of validation people two in three are off by less.
_EACH_S = 0.15
# Frames: the standard deviation of a duration that two frames bound, each of which is off by half of one at most.
_FRAME = np.sqrt(2 / 12)


def counted_rows(motion: Motion, every: Sequence[Counted]) -> list[Row]:
    """The groups of all movements, curves of both sides in one."""
    rows: list[Row] = []
    for place, movements in groupby(every, _with_curves):
        curves: list[Row] = []
        for counted in movements:
            spans = np.array(
                [(repetition.start_s, repetition.stop_s) for repetition in counted.events if repetition.whole]
            ).reshape(-1, 2)
            for angle in counted.movement.shown:
                curves += mean_curve(motion, angle, spans)
            group_rows = [observable(counted.observable), *_figures(motion, counted)]
            rows += _inside(counted.movement.name, group_rows, side_of(counted.movement.drivers[0]))
        rows += _inside(place, curves)
    return rows


def _with_curves(counted: Counted) -> str:
    """The group that has a movement's curves: of both arms it is one."""
    name = counted.movement.name
    return name.partition(".")[0] if name.startswith("arm_raises") else name


def _inside(place: str, rows: Sequence[Row], side: Side = "") -> list[Row]:
    """The rows in the group of that name. side: of an inner group."""
    group, _, inner = place.partition(".")
    return within(group, within(inner, rows, side) if inner else rows)


def _figures(motion: Motion, counted: Counted) -> list[Row]:
    """When repetitions were and how high; of those seen whole also how long."""
    events, driver, sd = counted.events, counted.driver, counted.sd
    if not events:
        return []
    angle = counted.movement.drivers[0]
    peaks = _peaks(motion, angle, events, sd)
    result: list[Row] = [
        Measure("count", len(events), at_least=counted.at_least),
        moments("start", (repetition.start_s for repetition in events)),
        moments("stop", (repetition.stop_s for repetition in events)),
        moments("peak_at", (repetition.peak_s for repetition in events)),
        *peaks,
    ]
    if counted.movement.in_place:
        result.append(_squats(motion, counted))
    if not (whole := [repetition for repetition in events if repetition.whole]):
        return result
    usual = known_median(sd)
    # Of a height above the valley, as of the whole rise. What a lifter has wrong of the posture in which a repetition
    # begins it has wrong of the same one at its end and in the next, so that all are too long, or all too short.
    height_sd = np.sqrt(2) * (usual if np.isfinite(usual) else unknown_deg(motion))
    ends_s = float(
        np.mean([near_ends_s(driver, motion.times, repetition, height_sd) for repetition in whole])
    )
    each_s = float(np.hypot(_FRAME / rate(motion.times), _EACH_S * np.isfinite(usual)))
    durations_s = np.array([repetition.stop_s - repetition.start_s for repetition in whole])
    return [
        *result,
        *spread("duration", durations_s, each_s, shared=ends_s),
        *spread("rise", np.array([repetition.rise for repetition in whole]), shared=height_sd),
    ]


def _peaks(motion: Motion, angle: str, events: Sequence[Repetition], sd: np.ndarray) -> list[Measure]:
    """Those that were seen, with their errors, if all have one; then the minimal detectable change."""
    with_peak = [i for i, repetition in enumerate(events) if np.isfinite(repetition.peak)]
    errors = [float(sd[np.searchsorted(motion.times, events[i].peak_s)]) for i in with_peak]
    all_known, usual = bool(np.isfinite(errors).all()), known_median(np.array(errors))
    mdc90 = SD_90 * error_of_difference(motion, f"peak.{of_both(angle)}", (usual, usual), "repetitions")
    peaks = [
        replace(with_error("peak", events[i].peak, error if all_known else np.nan), number=i)
        for i, error in zip(with_peak, errors, strict=True)
    ]
    return [*peaks, *([Measure("peak_mdc90", mdc90)] if all_known and len(peaks) > 1 else [])]


def _squats(motion: Motion, counted: Counted) -> Measure:
    """How many knee bends surely reach SQUAT, and whether there may be more."""
    peaks = np.array([bend.peak for bend in counted.events])
    sd = counted.sd[np.searchsorted(motion.times, [bend.peak_s for bend in counted.events])]
    bars = SD_90 * np.where(np.isfinite(sd), sd, unstated_deg(motion))
    sure, may = (int((peaks + sign * bars >= SQUAT).sum()) for sign in (-1, 1))
    return Measure("squats", sure, at_least=counted.at_least or may > sure or bool(np.isnan(peaks).any()))
