"""The moments of a take that its page shows: the peak of a squat or a raised arm, in the air, a foot's landing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.measures import Measures
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import nearest_row

_APART_S = 0.3  # closer, two pictures show the same
_LANDINGS = 2  # that are shown for their own sake: one of either foot
_SIDES = ("right", "left")


@dataclass(frozen=True)
class Event:
    """row: of the poses. words: what it is. at_s: when it was, as measured; None where it is a row's time."""

    row: int
    words: str
    at_s: float | None = None


def chosen_events(moments: Sequence[list[Event]], times: np.ndarray, most: int) -> list[Event]:
    """At most so many of `moments_of` a take, of every movement in turn, in order of time. times: (T,) of its poses."""
    *kinds, landings = ([*kind] for kind in moments)
    kinds.append(landings[:_LANDINGS])
    chosen: dict[int, Event] = {}
    while any(kinds) and len(chosen) < most:
        for kind in kinds:
            if kind and len(chosen) < most:
                event = kind.pop(0)
                if all(abs(times[event.row] - times[row]) > _APART_S for row in chosen):
                    chosen[event.row] = event
    return [chosen[row] for row in sorted(chosen)]


def moments_of(take: Take) -> list[list[Event]]:
    """Moments of each movement that the measures recognised, the first to be shown first: of repetitions the highest,
    as a page may have room for one; of initial contacts, which come last, those from the middle of the steps on,
    right and left in turn."""
    measures = take.figures
    jumps, arms = measures.group("jumps"), measures.group("arm_raises")
    flights = zip(jumps.times("start"), jumps.repetitions("flight_time"), strict=False)
    landed = sorted(
        (at_s, f"{side} initial contact")
        for side in _SIDES
        for at_s in measures.group("walking", side).times("landings")
    )
    middle = len(landed) // 2
    kinds = [
        [(start_s + flight.value / 2, "in the air") for start_s, flight in flights],
        _peaks(measures.group("knee_bends"), "knees bent"),
        *(_peaks(arms.group(side), f"{side} arm raised") for side in _SIDES),
        landed[middle:] + landed[:middle],
    ]
    times = take.need("poses").times
    return [[Event(int(nearest_row(times, at_s)), words, at_s) for at_s, words in kind] for kind in kinds]


def _peaks(group: Measures, words: str) -> list[tuple[float, str]]:
    """When repetitions whose peak is known are highest, and how high."""
    at_s = group.times("peak_at")
    peaks = sorted(group.repetitions("peak"), key=lambda peak: -peak.value)
    return [
        (at_s[peak.number], f"{words} {peak.value:z.0f}\u00b0") for peak in peaks if peak.number is not None
    ]
