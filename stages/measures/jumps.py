"""Jumps: how long the person flies and how high, and how long the feet are on the floor between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from ...models.angle_error.joint_noise import made_by_the_built_in
from ...models.common.motion import Motion
from ...models.gait.gait import FEWEST, FEWEST_FLYING, Gait, Stance, Step
from ...models.place.flights import GRAVITY, Airborne, Flight
from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.measures import Measure, Row
from ...pipeline.core.rotations import known_median
from ...pipeline.signals.filters import nearest_row
from .figures import moments, observable, with_error

_REBOUND_S = 1.0  # longer on the floor, and the next jump is another one
_ABSORBED_S = 0.6  # after a landing: by then the knees have given way
_STRIDE_S = 0.3  # nobody flies longer from step to step of a run
_HIGH = 0.15  # statures: nor gets the lower ankle so high; in runs it rises to 0.1, in hops among them 0.23 and more
_FEWEST_STEPS = {"walking": FEWEST, "running": FEWEST_FLYING}
_CM = 100.0
_LEAVES = 1.2  # statures a second, of feet that leave the floor or meet it: 2 m/s, of a jump of 20 cm
_LEGS = tuple(f"{side}_{joint}" for side in "rl" for joint in ("knee", "ankle"))


def _errors(motion: Motion, airborne: Airborne, flight: Flight) -> tuple[float, float]:
    """Standard deviations of a time in the air or on the floor, in seconds, and of a rise, in statures: what holds for
    nine in ten flights of train and validation subjects, by 1.645. Captured: 88 against the feet's
    true contacts, frames at either end, and how far the ankle is stretched. Lifted: the same before cameras, typical
    and wild, where the error of up counts, and by how much a camera shakes, at either end of a rise. NaN for a
    lifter whose errors were not measured, and where the camera may move: then it would move what falls."""
    if motion.filtered.measured_root is not None:
        return 0.026, 0.013
    if not (made_by_the_built_in(motion.source) and np.isfinite(airborne.shake)):
        return np.nan, np.nan
    up_deg, shakes = known_median(motion.rectified.up_error_deg), np.sqrt(2) * airborne.shake
    rise = np.linalg.norm([0.012, 0.036 * (flight.land_s - flight.off_s), 0.004 * up_deg, shakes])
    return float(np.linalg.norm([0.026, 0.003 * up_deg, shakes / _LEAVES])), float(rise)


def jumping(motion: Motion, airborne: Airborne, gait: Gait) -> list[Flight]:
    """The flights that are jumps: not those from step to step of a run. A walk has none, so one among its steps is.
    Nor those in the middle of which a leg is not known: a detector may have taken something else for the legs. Of 59
    flights of lifted takes (validation people, and jumps of train people) none is one."""
    legs = motion.has(_LEGS)

    def strides(flight: Flight) -> bool:  # from step to step of a run
        brief = gait.kind == "running" and flight.land_s - flight.off_s <= _STRIDE_S
        return brief and any(
            step.start_s < flight.land_s and flight.off_s < step.stop_s for step in gait.steps
        )

    return [
        flight
        for flight in airborne.flights
        if (flight.clear > _HIGH or not strides(flight))
        and legs[nearest_row(motion.times, (flight.off_s + flight.land_s) / 2)]
    ]


def landings(airborne: Airborne) -> list[tuple[float, float]]:
    """(begin, end) in seconds in which the knees take up a landing."""
    return [(flight.land_s, flight.land_s + _ABSORBED_S) for flight in airborne.flights]


def without_leaps(gait: Gait, jumped: Sequence[Flight]) -> Gait:
    """The gait without the steps in which the person jumps, as over a hurdle: a walk or run ends before, and the next
    begins behind. No foot stands in the air."""

    def leaps(step: Step) -> bool:  # or lands in the first half of a flight, where no foot is on the floor
        return any(
            step.start_s <= (flight.off_s + flight.land_s) / 2 and flight.off_s < step.stop_s
            for flight in jumped
        )

    def stands(stance: Stance) -> bool:
        return not any(flight.off_s < stance.start_s and stance.stop_s < flight.land_s for flight in jumped)

    fewest = _FEWEST_STEPS.get(gait.kind, 0)
    pieces = [(leap, list(steps)) for walk in gait.walks for leap, steps in groupby(walk, leaps)]
    walks = [steps for leap, steps in pieces if not leap and len(steps) >= fewest]
    return replace(
        gait, walks=walks, feet={side: [*filter(stands, stances)] for side, stances in gait.feet.items()}
    )


def jumps(motion: Motion, airborne: Airborne, jumped: Sequence[Flight]) -> list[Row]:
    """The group `jumps`: how many, when the feet leave the floor, on how many they take off and land, flight times,
    heights by these, and by how much the centre of mass rises (models/place/flights.py); the time on the floor
    before a rebound. jumped: of `jumping`."""
    judged = observable(motion.has(_LEGS) & airborne.observable)
    if not jumped:
        return [judged]
    stature = float(implied_stature(motion.rectified.level.joints))
    rows: list[Row] = [
        judged,
        Measure("count", len(jumped), at_least=airborne.cut),
        moments("start", (flight.off_s for flight in jumped)),
    ]
    for i, flight in enumerate(jumped):
        (sd_s, rise_sd), time_s = _errors(motion, airborne, flight), flight.land_s - flight.off_s
        floor_s = flight.off_s - jumped[i - 1].land_s if i else np.inf
        figures = {
            "flight_time": (time_s, sd_s),
            "height_by_flight_time": (_CM * GRAVITY / 8 * time_s**2, _CM * GRAVITY / 4 * time_s * sd_s),
            "jump_height": (flight.rise * stature, rise_sd * stature),
        }
        if 0 < floor_s < _REBOUND_S:
            figures["contact_time"] = floor_s, sd_s
        rows += [
            Measure("take_off_feet", flight.off_feet, number=i),
            Measure("landing_feet", flight.land_feet, number=i),
            *(replace(with_error(name, *figure), number=i) for name, figure in figures.items()),
        ]
    return rows
