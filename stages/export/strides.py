"""Every stride and repetition by itself: all angles with their errors at each per cent of it, and events."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...pipeline.core.measures import Measures, Side
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import near, unwrapped
from ...pipeline.signals.filters import around, breaks, each_path, resample
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ..measures.cycles import POINTS

_OTHER: dict[str, Side] = {"right": "left", "left": "right"}
_WITH_CYCLES = ("knee_bends", "arm_raises", "repetitions", "walking")
_OF_CYCLE = ("movement", "side", "number", "percent", "time_s", "event")


class Cycle(NamedTuple):
    """One stride or repetition. movement: the group of its measures, joined by dots. number: which, from 0 on."""

    movement: str
    side: Side
    number: int
    start_s: float
    stop_s: float


def cycles_of(measures: Measures) -> Iterator[Cycle]:
    """All strides and repetitions of a take's measures, in the order of summary.json."""
    for of in _moving(measures):
        for number, (start_s, stop_s) in enumerate(of.spans):
            yield Cycle(".".join(of.path), of.rows[0].side, number, start_s, stop_s)


def _moving(measures: Measures) -> Iterator[Measures]:
    """The groups of strides and repetitions; postures that are held are none."""
    for name, of in measures.groups.items():
        if (measures.path or name in _WITH_CYCLES) and name != "holds":
            yield of
            yield from _moving(of)


def columns_of(take: Take) -> list[str]:
    """The columns of `stride_rows`."""
    return [*_OF_CYCLE, *_of_angles(take)]


def _of_angles(take: Take) -> list[str]:
    return [f"{name}{end}" for name in _angles(take) for end in ("_deg", "_sd_deg")]


def stride_rows(take: Take) -> Iterator[dict[str, Any]]:
    """A row for each stride or repetition and each per cent of it, 0 to 100: the time of the take, the event that is
    nearest to it, and every angle and its standard deviation in degrees, linear between frames; NaN where it is
    missing. An angle goes on through the end of its range within one cycle."""
    if take.measures is None or take.filtered is None:
        return
    times, seams, columns = take.filtered.times, breaks(take.filtered), take.need("kinematics")
    own, degrees = _of_angles(take), [f"{name}_deg" for name in _angles(take)]
    angles = np.stack(
        [unwrapped(columns[name]) if name in degrees else columns[name] for name in own], axis=-1
    )
    for cycle in cycles_of(take.measures):
        at_s = np.linspace(cycle.start_s, cycle.stop_s, POINTS)
        events = (
            _events(take.measures.group("walking"), cycle) if cycle.movement.startswith("walking") else {}
        )
        near = around(times, at_s)
        own_seams = [seam - near.start for seam in seams if near.start < seam < near.stop]
        at_percents = partial(resample, time_s=times[near], at_s=at_s, seams=own_seams)
        curves = each_path(at_percents, angles[near].astype(np.float64), POINTS)
        values = dict(zip(own, curves.T, strict=True))
        for name in degrees:
            values[name] = _within_range(values[name], ALL_ANGLES[name.removesuffix("_deg")].centre_deg)
        for percent in range(POINTS):
            yield {
                "movement": cycle.movement,
                "side": cycle.side,
                "number": cycle.number,
                "percent": percent,
                "time_s": float(at_s[percent]),
                "event": events.get(percent, ""),
                **{column: float(of[percent]) for column, of in values.items()},
            }


def _angles(take: Take) -> list[str]:
    return [name for name in ALL_ANGLES if f"{name}_deg" in take.need("kinematics")]


def _events(walking: Measures, cycle: Cycle) -> dict[int, str]:
    """By the nearest per cent of a stride: initial contacts and toe-offs of its own foot and of the other. walking:
    that group of a take."""
    found = {}
    for prefix, side in (("other ", _OTHER[cycle.side]), ("", cycle.side)):
        for name, words in (("toe_offs", "toe-off"), ("landings", "initial contact")):
            for at_s in walking.group(side).times(name):
                percent = 100 * (at_s - cycle.start_s) / (cycle.stop_s - cycle.start_s)
                if -0.5 <= percent <= 100.5:
                    found[round(percent)] = f"{prefix}{words}"
    return found


def _within_range(curve_deg: np.ndarray, centre_deg: float) -> np.ndarray:
    """A curve (101,) moved by whole turns, so that it begins within 180 degrees of centre_deg."""
    known = curve_deg[np.isfinite(curve_deg)]
    return curve_deg + near(known[0], centre_deg) - known[0] if len(known) else curve_deg
