"""Every stride and repetition by itself: all angles with their errors at each per cent of it, and events."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...pipeline.core.measures import Measures, Side
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import near, unwrapped
from ...pipeline.signals.filters import around, breaks, each_path, resample
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ..measures.cycles import POINTS
from .tables import write_as_text

if TYPE_CHECKING:
    import pyarrow as pa

_OTHER: dict[str, Side] = {"right": "left", "left": "right"}
_WITH_CYCLES = ("knee_bends", "arm_raises", "repetitions", "walking")


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


def write_strides(take: Take, path: Path) -> None:
    """strides.csv: a line of names, then 101 lines a stride or repetition; commas between, a point in numbers, what is
    missing is empty. A take without measures has none but the names."""
    write_as_text(path, stride_tables(take))


def stride_tables(take: Take) -> Iterator[pa.Table]:
    """A table without rows, which has the names of the columns; then one for each stride or repetition, whose rows are
    each per cent of it, 0 to 100: the time of the take, the event that is nearest to it, and every angle and its
    standard deviation in degrees, of a spline through the frames; null where it is missing. An angle goes on through
    the end of its range within one cycle."""
    import pyarrow as pa

    degrees = [f"{name}_deg" for name in _angles(take)]
    angle_columns = [column for name in _angles(take) for column in (f"{name}_deg", f"{name}_sd_deg")]
    kinds = {"movement": pa.string(), "side": pa.string(), "number": pa.int32(), "percent": pa.int32()}
    kinds |= {"time_s": pa.float64(), "event": pa.string()} | dict.fromkeys(angle_columns, pa.float32())
    yield pa.schema(kinds).empty_table()
    if take.measures is None or take.filtered is None:
        return
    times, seams, columns = take.filtered.times, breaks(take.filtered), take.need("kinematics")
    angles = np.stack(
        [unwrapped(columns[name]) if name in degrees else columns[name] for name in angle_columns], axis=-1
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
        values = dict(zip(angle_columns, curves.T, strict=True))
        for name in degrees:
            values[name] = _within_range(values[name], ALL_ANGLES[name.removesuffix("_deg")].centre_deg)
        labels = {"movement": cycle.movement, "side": cycle.side, "number": cycle.number}
        rows = {name: [value] * POINTS for name, value in labels.items()}
        rows |= {"percent": np.arange(POINTS), "time_s": at_s}
        rows |= {"event": [events.get(percent, "") for percent in range(POINTS)]} | values
        yield pa.table(
            [pa.array(rows[name], kind, from_pandas=True) for name, kind in kinds.items()], pa.schema(kinds)
        )


def _angles(take: Take) -> list[str]:
    return [name for name in ALL_ANGLES if f"{name}_deg" in take.need("kinematics")]


def _events(walking: Measures, cycle: Cycle) -> dict[int, str]:
    """By the nearest per cent of a stride: initial contacts and toe-offs of its own foot and of the other. walking:
    that group of a take."""
    events = {}
    for prefix, side in (("other ", _OTHER[cycle.side]), ("", cycle.side)):
        for name, words in (("toe_offs", "toe-off"), ("landings", "initial contact")):
            for at_s in walking.group(side).times(name):
                percent = 100 * (at_s - cycle.start_s) / (cycle.stop_s - cycle.start_s)
                if -0.5 <= percent <= 100.5:
                    events[round(percent)] = f"{prefix}{words}"
    return events


def _within_range(curve_deg: np.ndarray, centre_deg: float) -> np.ndarray:
    """A curve (101,) moved by whole turns, so that it begins within 180 degrees of centre_deg."""
    finite = curve_deg[np.isfinite(curve_deg)]
    return curve_deg + near(finite[0], centre_deg) - finite[0] if len(finite) else curve_deg
