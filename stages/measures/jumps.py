"""Jumps: how long the person flies and how high, and how long the feet are on the floor between."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from ...models.gait.events import Stance, Step
from ...models.gait.gait import Gait
from ...models.place.airborne import Airborne
from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.measures import Measure, Remark, Row
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import Rectified
from ...pipeline.signals.doubtful_flights import Hop
from ...pipeline.signals.flights import GRAVITY, Flight
from .figures import moments, with_error
from .off_keypoints import contradicts

_REBOUND_S = 1.0  # longer on the floor, and the next jump is another one
_ABSORBED_S = 0.6  # after a landing: by then the knees have given way
# In so many seconds before the knees are bent most the lower ankle falls by more statures where somebody lands. Of 71
# bends of lifted takes (train and validation people) 13 follow a captured fall of 0.05 and more, which is a foot off
# its toes: twelve of these fall by 0.07 and more, the others by 0.046 at most, among them all that are labelled.
_FALLS_S, _FALLS = 0.5, 0.06
_STRIDE_S = 0.3  # nobody flies longer from step to step of a run
_HIGH = 0.15  # statures: nor gets the lower ankle so high; in runs it rises to 0.1, in hops among them 0.23 and more
_FEWEST_STEPS = {"walking": 3, "running": 2}  # as models/gait/events.py counts them
_CM = 100.0
_UNSURE = "it is uncertain whether the feet leave the floor from"


@dataclass(frozen=True)
class _Errors:
    """Standard deviations: of a time in the air or on the floor, in seconds; of a rise, in statures."""

    time_s: float
    rise: float

    def height_m(self, time_s: float) -> float:
        """Of a height by so long a flight."""
        return GRAVITY / 4 * time_s * self.time_s


def _errors(airborne: Airborne, flight: Flight, up_deg: float) -> _Errors:
    """What holds for nine in ten flights of train and validation subjects, by 1.645. Captured: 88 against the feet's
    true contacts, frames at either end, and how far the ankle is stretched. Lifted: the same before cameras, typical
    and wild, where the error of up (up_deg) counts. NaN for a lifter whose errors were not measured, and where the
    camera may move: then it would move what falls."""
    if not airborne.lifted:
        return _Errors(0.026, 0.013)
    if not (airborne.judged and airborne.still):
        return _Errors(np.nan, np.nan)
    rise = np.linalg.norm([0.012, 0.036 * (flight.land_s - flight.off_s), 0.004 * up_deg])
    return _Errors(float(np.hypot(0.029, 0.003 * up_deg)), float(rise))


def without_slips(airborne: Airborne, against: Mapping[str, Sequence[tuple[float, float]]]) -> Airborne:
    """Flights in the middle of which a leg contradicts its keypoints are uncertain: a detector may have taken something
    else for the legs. Of 59 flights of lifted takes (validation people, and jumps of train people) none is one.
    against: of off_keypoints.not_shown."""

    def slips(flight: Flight) -> bool:
        return contradicts((flight.off_s + flight.land_s) / 2, against, "r_leg", "l_leg")

    doubtful = (
        Hop(flight.off_s, flight.land_s, flight.clear) for flight in airborne.flights if slips(flight)
    )
    return replace(
        airborne,
        flights=tuple(flight for flight in airborne.flights if not slips(flight)),
        uncertain=(*airborne.uncertain, *doubtful),
    )


def jumping(airborne: Airborne, gait: Gait) -> list[Flight]:
    """The flights that are jumps: not those from step to step of a run. A walk has none, so one among its steps is."""
    return [
        flight
        for flight in airborne.flights
        if flight.clear > _HIGH or not _strides(flight.off_s, flight.land_s, gait)
    ]


def cut_jumps(airborne: Airborne, gait: Gait) -> list[tuple[float, float]]:
    """(begin, end) in seconds of what was seen of jumps that the take begins or ends in: not of a run's, whose first
    step that was seen begins after such a flight, and whose last one ends before."""
    return [(a, b) for a, b in airborne.cut if not _strides(a, b, gait, _STRIDE_S)]


def unsure_hops(airborne: Airborne, gait: Gait) -> list[tuple[float, float]]:
    """(begin, end) in seconds of hops that are not sure: not of those from step to step of a run."""
    return [
        (hop.start_s, hop.stop_s)
        for hop in airborne.uncertain
        if hop.clear > _HIGH or not _strides(hop.start_s, hop.stop_s, gait)
    ]


def _strides(begin_s: float, end_s: float, gait: Gait, around_s: float = 0.0) -> bool:
    """Whether a flight is one from step to step of a run."""
    return (
        gait.kind == "running"
        and end_s - begin_s <= _STRIDE_S
        and any(step.start_s - around_s < end_s and begin_s < step.stop_s + around_s for step in gait.steps)
    )


def without_leaps(gait: Gait, jumped: Sequence[Flight]) -> Gait:
    """The gait without the steps in which the person jumps, as over a hurdle: a walk or run ends before, and the next
    begins behind. No foot stands in the air."""

    def leaps(step: Step) -> bool:  # or lands in the first half of a flight, where no foot is on the floor
        return any(
            step.start_s <= (flight.off_s + flight.land_s) / 2 and flight.off_s < step.stop_s
            for flight in jumped
        )

    def stands(stance: Stance) -> bool:
        return not any(one.off_s < stance.start_s and stance.stop_s < one.land_s for one in jumped)

    fewest = _FEWEST_STEPS.get(gait.kind, 0)
    pieces = [(leap, list(steps)) for walk in gait.walks for leap, steps in groupby(walk, leaps)]
    walks = [steps for leap, steps in pieces if not leap and len(steps) >= fewest]
    return replace(gait, walks=walks, feet={side: [*filter(stands, of)] for side, of in gait.feet.items()})


def goes_on(gait: Gait, seen: Sequence[slice], time_s: np.ndarray, jumped: Sequence[Flight]) -> str:
    """Why a walk may have more steps than were seen whole: who stops stays for more than a stride, as in
    models/gait/events.py, and that was not seen; or a jump interrupts it. "" where neither. seen: rows of time_s (T,)
    that show both legs."""
    stride_s = 2 * float(np.mean([step.stop_s - step.start_s for step in gait.steps]))
    first, last = np.array([(walk[0].start_s, walk[-1].stop_s) for walk in gait.walks]).T
    starts, stops = np.array([(time_s[rows.start], time_s[rows.stop - 1]) for rows in seen]).T
    offs, lands = np.array([(flight.off_s, flight.land_s) for flight in jumped]).reshape(-1, 2).T

    def follows(before: np.ndarray, after: np.ndarray) -> bool:
        apart = np.subtract.outer(after, before)
        return bool(((apart >= 0) & (apart < stride_s)).any())

    cut = ["begins"] * follows(starts, first) + ["ends"] * follows(last, stops)
    why = [f"how it {' and '.join(cut)} was not seen"] if cut else []
    why += ["a jump interrupts it"] * (follows(last, offs) or follows(lands, first))
    return "; ".join(why)


def absorbs(flights: Sequence[tuple[float, float]], low_s: float) -> bool:
    """Whether the body is lowest, at low_s, because it has just landed. flights: (begin, end) in seconds."""
    return any(0 <= low_s - land_s < _ABSORBED_S for _, land_s in flights)


def lands(ankle: np.ndarray, time_s: np.ndarray, low_s: float) -> bool:
    """Whether the body is lowest, at low_s, because it may have just landed, also from a hop that is no sure flight.
    ankle: (T,) of Airborne, at time_s (T,)."""
    before = ankle[(time_s >= low_s - _FALLS_S) & (time_s <= low_s) & np.isfinite(ankle)]
    return bool(len(before) and before.max() - before[-1] > _FALLS)


def jumps(
    airborne: Airborne,
    found: Sequence[Flight],
    cut: Sequence[tuple[float, float]],
    unsure: Sequence[tuple[float, float]],
    rectified: Rectified,
    landings: Sequence[tuple[float, float]] = (),
) -> list[Row]:
    """The group `jumps`: how many of `jumping`, when the feet leave the floor, on how many they take off and land,
    flight times, heights by these, and by how much the centre of mass rises (pipeline/signals/flights.py); the time on
    the floor before a rebound. `count_reason`: where there may be more. No count where jumps
    cannot be told, and why. found: of `jumping`; cut: of `cut_jumps`; unsure: of `unsure_hops`; landings: (begin, end)
    in seconds of knee bends that may take up one."""
    if not found and airborne.reason:
        return [Remark("reason", airborne.reason)]
    doubt = [f"{_UNSURE} {spans_in_words(unsure)}"] * bool(unsure)
    may_land = [f"what is seen from {spans_in_words(landings)} may be a landing"] * bool(landings)
    if not found:
        part = [f"only part of one was seen, from {spans_in_words(cut)}"] * bool(cut)
        why = "; ".join([*(part or doubt), *airborne.hides] or may_land)
        return [Measure("count", 0), *([Remark("reason", why)] if why else [])]
    stature = float(implied_stature(rectified.level.joints))
    up_deg = float(np.nanmedian(rectified.up_error_deg)) if airborne.lifted else 0.0
    errors = [_errors(airborne, flight, up_deg) for flight in found]
    each = list(enumerate(zip(found, errors, strict=True)))

    def times(flight: Flight) -> float:
        return flight.land_s - flight.off_s

    heights = [
        (i, GRAVITY / 8 * times(flight) ** 2, error.height_m(times(flight))) for i, (flight, error) in each
    ]
    why = "; ".join([*[airborne.reason] * bool(airborne.reason), *doubt, *airborne.hides] or may_land)
    return [
        Measure("count", len(found)),
        *([Remark("count_reason", why)] if why else []),
        moments("start", (flight.off_s for flight in found)),
        *(Measure("take_off_feet", flight.off_feet, number=i) for i, flight in enumerate(found)),
        *(Measure("landing_feet", flight.land_feet, number=i) for i, flight in enumerate(found)),
        *_numbered("flight_time", "s", ((i, times(flight), error.time_s) for i, (flight, error) in each)),
        *_numbered(
            "height_by_flight_time", "cm", ((i, _CM * high, _CM * error) for i, high, error in heights)
        ),
        *_numbered(
            "jump_height",
            "length",
            ((i, flight.rise * stature, error.rise * stature) for i, (flight, error) in each),
        ),
        *_numbered("contact_time", "s", _contacts(found, errors, unsure)),
    ]


def _contacts(
    found: Sequence[Flight], errors: Sequence[_Errors], unsure: Sequence[tuple[float, float]]
) -> Iterator[tuple[int, float, float]]:
    """(number of the jump, seconds on the floor before it, error) of rebounds. unsure: of
    `unsure_hops`."""
    for i in range(1, len(found)):
        start_s, stop_s = found[i - 1].land_s, found[i].off_s
        contact_s = stop_s - start_s
        left = any(start_s < until_s and since_s < stop_s for since_s, until_s in unsure)
        if 0 < contact_s < _REBOUND_S and not left:
            yield i, contact_s, errors[i].time_s


def _numbered(name: str, unit: str, each: Iterable[tuple[int, float, float]]) -> list[Measure]:
    return [replace(with_error(name, unit, value, error), number=i) for i, value, error in each]
