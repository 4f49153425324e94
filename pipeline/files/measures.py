"""The columns of measures.csv and cycles.csv, and the rows of a take's measures read back from them."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from ..core import measures
from ..core.errors import InputError
from ..core.measures import MOMENTS, OF_LENGTH, UNITS, Curve, Curves, Measure, Moments, Remark, Side


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


def read_measures(folder: Path) -> tuple[measures.Row, ...]:
    """What `write_measures` and `write_cycles` (stages/export/measures.py) have
    written in a run's folder, but that a figure lies within its error
    is a remark; nothing where they have not. InputError for files that are not theirs."""
    if not (folder / "measures.csv").exists():
        return ()
    try:
        figures = [_read(row) for row in _lines(folder / "measures.csv", Row._fields)]
        points = _lines(folder / "cycles.csv", Point._fields) if (folder / "cycles.csv").exists() else []
        return (*_joined(figures), *_curves(points))
    except (OSError, ValueError, KeyError) as error:
        raise InputError(
            "file-damaged",
            f"Expected measures.csv and cycles.csv as a run writes them in {folder}: {error}; run the take again.",
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
