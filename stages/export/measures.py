"""measures.csv and measures.parquet: the take's figures as one tidy table, a row for each; and cycles.csv: its curves
over repetitions and strides."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ...pipeline.core.errors import InputError
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from ..measures.figures import error_key, of_length
from .provenance import provenance

_UNITS = {
    "deg": "deg",
    "degps": "deg/s",
    "s": "s",
    "percent": "%",
    "spm": "1/min",
}  # by the last word of a key
_SIDES = {"r": "right", "right": "right", "l": "left", "left": "left"}
_CURVES = "cycles"  # the key of a movement's curves


class Row(NamedTuple):
    """One figure. measure: the keys that lead to it in summary.json, joined by dots. side: "right", "left" or None.
    item: which of a list, from 0 on; None for a single figure. value: a number, or None where `text` says something.
    error: its standard error, where it is stated. unit: "deg", "s", "%", "1/min", the take's unit of length or that a
    second, None for pure numbers. start_s, stop_s: of the repetition that the figure is of; None where it is of the
    take."""

    measure: str
    side: str | None
    item: int | None
    value: float | None
    error: float | None
    unit: str | None
    start_s: float | None
    stop_s: float | None
    text: str | None


class Point(NamedTuple):
    """One point of a movement's mean curve. movement: the keys that lead to it in summary.json, joined by dots. angle:
    of pipeline.signals.foot_angles.ALL_ANGLES; side: "right", "left" or None. percent: of the repetition, or of a
    stride
    of that side. mean_deg, sd_deg: over the cycles, the second None for one. count: how many cycles these are."""

    movement: str
    angle: str
    side: str | None
    percent: int
    mean_deg: float
    sd_deg: float | None
    count: int


def write_measures(take: Take, path: Path) -> None:
    """measures.csv: a line with the names of Row's fields, then a line a figure, UTF-8, commas between, a point in
    numbers; what is None is empty. A take without measures has none but the first line."""
    _write(path, Row._fields, rows(take))


def write_cycles(take: Take, path: Path) -> None:
    """cycles.csv: the same with Point's fields, 101 lines a curve."""
    _write(path, Point._fields, curve_points(take))


def write_measures_parquet(take: Take, path: Path) -> None:
    """measures.parquet: the same columns, missing is null; the schema's metadata are the provenance. InputError for a
    take without measures."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if take.measures is None:
        raise InputError("A table of measures needs them; put the stage 'measures' before 'export'.")
    kinds = dict.fromkeys(Row._fields, pa.float64()) | {"item": pa.int32()}
    kinds |= dict.fromkeys(("measure", "side", "unit", "text"), pa.string())
    table = pa.Table.from_pylist([row._asdict() for row in rows(take)], pa.schema(kinds, provenance(take)))
    with whole_file(path) as partial:
        pq.write_table(table, partial)


def rows(take: Take) -> Iterator[Row]:
    """The take's figures in the order of summary.json, without its curves. A figure's error stands beside it and has no
    row of its own."""
    yield from _rows(take.measures or {}, (), take.need("poses").frame.unit)


def curve_points(take: Take) -> Iterator[Point]:
    """The curves of the take's movements over their cycles, in the order of summary.json."""
    yield from _points(take.measures or {}, ())


def _points(group: dict[str, Any], above: tuple[str, ...]) -> Iterator[Point]:
    for key, value in group.items():
        if key == _CURVES:
            for angle, curve in value.items():
                spread = curve.get("sd_deg") or [None] * len(curve["mean_deg"])
                for percent, (mean, sd) in enumerate(zip(curve["mean_deg"], spread, strict=True)):
                    yield Point(".".join(above), angle, _side((angle,)), percent, mean, sd, curve["count"])
        elif isinstance(value, dict):
            yield from _points(value, (*above, key))


def _write(path: Path, names: tuple[str, ...], lines: Iterator[tuple[Any, ...]]) -> None:
    with whole_file(path) as partial, open(partial, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(lines)


def _rows(group: dict[str, Any], above: tuple[str, ...], length: str) -> Iterator[Row]:
    errors = {error_key(key) for key in group}
    for key, value in group.items():
        path = (*above, key)
        if key == _CURVES:
            continue
        if isinstance(value, dict):
            yield from _rows(value, path, length)
        elif key not in errors:
            for item, one in enumerate(value) if isinstance(value, list) else [(None, value)]:
                number = isinstance(one, int | float) and not isinstance(one, bool)
                yield Row(
                    ".".join(path),
                    _side(path),
                    item,
                    float(one) if number else None,
                    _beside(value, item, group.get(error_key(key))),
                    _unit(key, length) if number else None,
                    _beside(value, item, group.get("start_s")),
                    _beside(value, item, group.get("stop_s")),
                    None if number else str(one),
                )


def _beside(value: Any, item: int | None, other: Any) -> Any:
    """What of `other` belongs to an item of a figure, None where it is no figure of the same kind."""
    if item is None:
        return None if isinstance(other, list) else other
    return other[item] if isinstance(other, list) and len(other) == len(value) else None


def _side(path: tuple[str, ...]) -> str | None:
    """By the first of the keys that begins with a side."""
    return next((_SIDES[word] for key in path if (word := key.partition("_")[0]) in _SIDES), None)


def _unit(key: str, length: str) -> str | None:
    if of_length(key):
        return f"{length}/s" if key.endswith("_speed") else length
    return _UNITS.get(key.rpartition("_")[2])
