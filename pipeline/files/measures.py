"""The columns of measures.csv, and the rows of a take's measures read back from them."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

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


def read_measures(folder: Path) -> tuple[measures.Row, ...]:
    """What `write_measures` (stages/export/measures.py) has written in a run's folder, and the mean curves of its
    summary.json, but that a figure lies within its error is a remark; nothing where it has not. InputError for files
    that are not theirs."""
    if not (folder / "measures.csv").exists():
        return ()
    try:
        figures = [_read(row) for row in _lines(folder / "measures.csv", Row._fields)]
        summary = folder / "summary.json"
        said = json.loads(summary.read_text(encoding="utf-8")) if summary.exists() else {}
        return (*_joined(figures), *_curves(said.get("measures") or {}))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(
            "file-damaged",
            f"Expected measures.csv and summary.json as a run writes them in {folder}: {error}; run the take again.",
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
    """Moments in one row each; counts that may be more as such; without what the figure before says itself."""
    for (group, name), same in groupby(_with_least(figures), lambda row: (row.group, row.name)):
        rows = list(same)
        if name in MOMENTS:
            at_s = tuple(row.value for row in rows if isinstance(row, Measure))
            yield Moments(name, at_s, rows[0].side, group)
        else:
            yield from rows


def _with_least(figures: list[Measure | Remark]) -> Iterator[Measure | Remark]:
    more = {(row.group, row.name) for row in figures if isinstance(row, Remark)}
    for row in figures:
        if isinstance(row, Measure):
            yield replace(row, at_least=(row.group, f"{row.name}_at_least") in more)
        elif not row.name.endswith("_at_least"):
            yield row


def _curves(measures: Mapping[str, Any], group: tuple[str, ...] = ()) -> Iterator[Curves]:
    """Those of measures as summary.json has them."""
    for name, of in measures.items():
        if name == "cycles":
            yield Curves(
                tuple(
                    Curve(angle, one["count"], tuple(one["mean_deg"]), tuple(one.get("sd_deg") or ()) or None)
                    for angle, one in of.items()
                ),
                group,
            )
        elif isinstance(of, dict):
            yield from _curves(of, (*group, name))
