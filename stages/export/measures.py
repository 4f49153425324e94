"""measures.csv and measures.parquet: the take's figures as one tidy table, a row for each; and cycles.csv: its curves
over repetitions and strides."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from ...pipeline.core import measures
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import (
    MOMENTS,
    OF_LENGTH,
    UNITS,
    Curve,
    Curves,
    Group,
    Measure,
    Moments,
    Remark,
    Side,
    grouped,
    moments,
)
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import whole_file
from .provenance import provenance


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
    length = take.need("poses").frame.unit
    yield from _rows(grouped(take.measures or ()), (), length)


def read_measures(folder: Path) -> tuple[measures.Row, ...]:
    """What `write_measures` and `write_cycles` have written in a run's folder, but that a figure lies within its error
    is a remark; nothing where they have not. InputError for files that are not theirs."""
    if not (folder / "measures.csv").exists():
        return ()
    try:
        figures = [_read(row) for row in _lines(folder / "measures.csv", Row._fields)]
        points = _lines(folder / "cycles.csv", Point._fields) if (folder / "cycles.csv").exists() else []
        return (*_joined(figures), *_curves(points))
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            f"Expected measures.csv and cycles.csv as a run writes them in {folder}: {error}; run the take again."
        ) from None


def _lines(path: Path, names: tuple[str, ...]) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file, strict=True)
        if tuple(reader.fieldnames or ()) != names:
            raise ValueError(f"{path.name} has other columns")
        lines = list(reader)
    if any(None in line or None in line.values() for line in lines):
        raise ValueError(f"{path.name} has a row of another length")
    return lines


_UNIT_OF = {unit.table: name for name, unit in UNITS.items()}
_UNIT_OF |= {UNITS[name].table.format(length): name for name in OF_LENGTH for length in ("m", "arbitrary")}
_SIDES: dict[str, Side] = {"right": "right", "left": "left", "": ""}


def _read(line: dict[str, str]) -> Measure | Remark:
    *group, key = line["measure"].split(".")
    side = _SIDES[line["side"]]
    if not line["value"]:
        return Remark(key, line["text"], side, tuple(group))
    unit = _UNIT_OF[line["unit"]]
    number = int(line["item"]) if line["item"] else None
    error = float(line["error"]) if line["error"] else None
    name = key.removesuffix(UNITS[unit].ending)
    return Measure(name, float(line["value"]), unit, error, side, number, group=tuple(group))


def _joined(figures: list[Measure | Remark]) -> Iterator[measures.Row]:
    """Moments in one row each."""
    for (group, name), same in groupby(figures, lambda row: (row.group, row.name)):
        rows = list(same)
        if name in MOMENTS:
            at_s = tuple(row.value for row in rows if isinstance(row, Measure))
            yield Moments(name, at_s, rows[0].side, group)
        else:
            yield from rows


def _curves(points: list[dict[str, str]]) -> Iterator[Curves]:
    by_group: dict[str, list[Curve]] = {}
    for (movement, angle), same in groupby(points, lambda point: (point["movement"], point["angle"])):
        lines = list(same)
        sd = tuple(float(line["sd_deg"]) for line in lines if line["sd_deg"])
        mean = tuple(float(line["mean_deg"]) for line in lines)
        by_group.setdefault(movement, []).append(Curve(angle, int(lines[0]["count"]), mean, sd or None))
    for movement, curves in by_group.items():
        yield Curves(tuple(curves), tuple(movement.split(".")))


def curve_points(take: Take) -> Iterator[Point]:
    """The curves of the take's movements over their cycles, in the order of summary.json."""
    for row in take.measures or ():
        for curve in row.of if isinstance(row, Curves) else ():
            sds = curve.sd_deg or [None] * len(curve.mean_deg)
            for percent, (mean, sd) in enumerate(zip(curve.mean_deg, sds, strict=True)):
                place = ".".join(row.group), curve.angle, curve.side or None
                yield Point(*place, percent, mean, sd, curve.count)


def _write(path: Path, names: tuple[str, ...], lines: Iterator[tuple[Any, ...]]) -> None:
    with whole_file(path) as partial, open(partial, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows(lines)


def _rows(group: Group, above: tuple[str, ...], length: str) -> Iterator[Row]:
    starts, stops = moments(group, "start"), moments(group, "stop")
    for name, leaf in group.items():
        if isinstance(leaf, dict):
            yield from _rows(leaf, (*above, name), length)
        elif isinstance(leaf, Remark):
            yield _said(".".join((*above, leaf.key)), leaf.side, leaf.text)
        elif isinstance(leaf, Moments):
            for i, at_s in enumerate(leaf.at_s):
                spans = _span(starts, stops, i) if len(leaf.at_s) == len(starts) else (None, None)
                yield Row(
                    ".".join((*above, leaf.key)), leaf.side or None, i, float(at_s), None, "s", *spans, None
                )
        elif not isinstance(leaf, Curves):
            for one in leaf if isinstance(leaf, list) else [leaf]:
                span = (None, None) if one.number is None else _span(starts, stops, one.number)
                unit = UNITS[one.unit].table.format(length) or None
                figure = one.side or None, one.number, float(one.value), one.error, unit
                yield Row(".".join((*above, one.key)), *figure, *span, None)
                if one.within_error is not None:
                    judged = ".".join((*above, one.within_error_key))
                    yield _said(judged, one.side, str(one.within_error))


def _said(measure: str, side: str, text: str) -> Row:
    return Row(measure, side or None, None, None, None, None, None, None, text)


def _span(starts: tuple[float, ...], stops: tuple[float, ...], i: int) -> tuple[float | None, float | None]:
    return (starts[i] if i < len(starts) else None), (stops[i] if i < len(stops) else None)
