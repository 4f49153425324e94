"""The moments of a take that its page shows: the lowest point of a squat, an arm's highest, in the air, a foot's
landing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.measures import Measures
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import nearest_row

_APART_S = 0.3  # closer, two pictures show the same
_LANDINGS = 2  # that are shown for their own sake: one of either foot
_SIDES = {"right": "r_", "left": "l_"}


@dataclass(frozen=True)
class Event:
    """row: of the poses. words: what it is. angle: the angle to be told beside it, "" for none.
    at_s: when it was, as measured; None where it is a row's time."""

    row: int
    words: str
    angle: str = ""
    at_s: float | None = None


def events(take: Take, most: int) -> list[Event]:
    """Moments of what the measures recognised, at most so many, of every movement in turn, in order of time."""
    *kinds, landings = _known(take)
    kinds.append(landings[:_LANDINGS])
    chosen: dict[int, Event] = {}
    times = take.need("poses").times
    while any(kinds) and len(chosen) < most:
        for kind in kinds:
            if kind and len(chosen) < most:
                event = kind.pop(0)
                if all(abs(times[event.row] - times[row]) > _APART_S for row in chosen):
                    chosen[event.row] = event
    return [chosen[row] for row in sorted(chosen)]


def event_beside(take: Take, row: int) -> Event:
    """The event of this row or of one beside it, and of no words where there is none."""
    beside = [event for kind in _known(take) for event in kind if abs(event.row - row) <= 1]
    return min(beside, key=lambda event: abs(event.row - row), default=Event(row, ""))


def _known(take: Take) -> list[list[Event]]:
    """Those of each movement, the first to be shown first."""
    measures = take.figures
    return [
        [*_jumps(take, measures.group("jumps"))],
        [*_bends(take, measures.group("knee_bends"))],
        [*_arms(take, measures.group("arm_raises"))],
        [*_landings(take, measures.group("walking"))],
    ]


def _jumps(take: Take, jumps: Measures) -> Iterator[Event]:
    starts = jumps.times("start")
    for time in jumps.repetitions("flight_time"):
        if time.number is not None and time.number < len(starts):
            middle_s = starts[time.number] + time.value / 2
            yield Event(int(nearest_row(take.need("poses").times, middle_s)), "in the air")


def _bends(take: Take, bends: Measures) -> Iterator[Event]:
    """The deepest first: a page may have room for one."""
    both = [_column(take, f"{side}knee_flexion") for side in _SIDES.values()]
    for row in _peaks(take, np.fmin(*both), _spans(bends)):
        side = "l_" if both[1][row] < both[0][row] else "r_"  # the less bent one, which is counted
        yield Event(row, "knees bent", f"{side}knee_flexion")


def _arms(take: Take, arms: Measures) -> Iterator[Event]:
    for side, short in _SIDES.items():
        angle = f"{short}shoulder_elevation"
        for row in _peaks(take, _column(take, angle), _spans(arms.group(side))):
            yield Event(row, f"{side} arm raised", angle)


def _landings(take: Take, walking: Measures) -> Iterator[Event]:
    """From the middle of the steps on, right and left in turn, and then those before."""
    landed = [(at, side) for side in _SIDES for at in walking.group(side).times("landings")]
    landed.sort()
    middle = len(landed) // 2
    for at_s, side in landed[middle:] + landed[:middle]:
        row = int(nearest_row(take.need("poses").times, at_s))
        yield Event(row, f"{side} foot lands", f"{_SIDES[side]}knee_flexion", at_s)


def _spans(group: Measures) -> list[tuple[float, float]]:
    """Of repetitions whose peak is known."""
    peaks = {peak.number for peak in group.repetitions("peak")}
    return [span for i, span in enumerate(group.spans) if i in peaks]


def _peaks(take: Take, values: np.ndarray, spans: list[tuple[float, float]]) -> list[int]:
    """The row of the highest of values (T,) in each span, the highest of all first."""
    rows = [row for span in spans if (row := _most(take, values, span)) is not None]
    return sorted(rows, key=lambda row: -float(values[row]))


def _most(take: Take, values: np.ndarray, span: tuple[float, float]) -> int | None:
    times = take.need("poses").times
    inside = (times >= span[0]) & (times <= span[1]) & np.isfinite(values)
    return int(np.flatnonzero(inside)[values[inside].argmax()]) if inside.any() else None


def _column(take: Take, angle: str) -> np.ndarray:
    nothing = np.full(len(take.need("poses")), np.nan)
    return (take.kinematics or {}).get(f"{angle}_deg", nothing)
