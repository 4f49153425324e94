"""measures.csv: the take's figures as one tidy table, a row for each."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from ...pipeline.core.figures import UNITS
from ...pipeline.core.measures import Measure, Measures, Moments, Remark
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import write_rows


class Row(NamedTuple):
    """One figure, a line of measures.csv. measure: the keys that lead to it in summary.json, joined by dots. side:
    "right", "left" or None. item: which of a list, from 0 on; None for a single figure. value: a number, or None where
    `text` says something. error: its standard error, where it is stated. unit: "deg", "s", "%", "1/min", the take's
    unit of length or that a second, None for pure numbers. start_s, stop_s: of the repetition that the figure is of;
    None where it is of the take."""

    measure: str
    side: str | None
    item: int | None
    value: float | None
    error: float | None
    unit: str | None
    start_s: float | None
    stop_s: float | None
    text: str | None


def write_measures(take: Take, path: Path) -> None:
    """measures.csv: a line with the names of Row's fields, then a line a figure. A take without measures
    has none but the first line."""
    write_rows(path, Row._fields, rows(take))


def rows(take: Take) -> Iterator[Row]:
    """The take's figures in the order of summary.json, without its curves. A figure's error stands beside it and has no
    row of its own."""
    length = take.need("poses").frame.unit
    for row in take.figures:
        of = take.figures.group(*row.group)
        place, side = ".".join((*row.group, "")), row.side or None
        if isinstance(row, Remark):
            yield _said(place + row.key, side, row.text)
        elif isinstance(row, Moments):
            of_repetitions = len(row.at_s) == len(of.times("stride_start") or of.times("start"))
            for i, at_s in enumerate(row.at_s):
                span = _span(of, i) if of_repetitions else (None, None)
                yield Row(place + row.key, side, i, float(at_s), None, "s", *span, None)
        elif isinstance(row, Measure):
            span = (None, None) if row.number is None else _span(of, row.number)
            unit = UNITS[row.unit].table.format(length) or None
            yield Row(place + row.key, side, row.number, float(row.value), row.error, unit, *span, None)
            for name, judged in row.judged.items():
                yield _said(place + name, side, str(judged))


def _said(measure: str, side: str | None, text: str) -> Row:
    return Row(measure, side, None, None, None, None, None, None, text)


def _span(of: Measures, i: int) -> tuple[float | None, float | None]:
    """When the repetition or stride of that number began and ended."""
    starts, stops = (of.times(end) or of.times(f"stride_{end}") for end in ("start", "stop"))
    return (starts[i] if i < len(starts) else None), (stops[i] if i < len(stops) else None)
