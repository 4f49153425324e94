"""A report's nested figures as a page of Markdown tables: a table for all figures that stand alike, a row for each
place they stand in, its keys in front."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..common.metrics import Figure

Row = tuple[tuple[str, ...], dict[str, Any]]


def written(results: Mapping[str, Any], title: str, about: str) -> str:
    """The page. about: what stands above the tables; what every report is asked (Question.heading) stands before it."""
    said = {name: value for name, value in results.items() if not isinstance(value, Mapping | list)}
    parts = [f"# {title}", ", ".join(f"{name} {_cell(value)}" for name, value in said.items()), about]
    for name, of in results.items():
        if isinstance(of, Mapping) and name != "device":
            parts += list(_tables(name, of))
    return "\n\n".join(part for part in parts if part) + "\n"


def _tables(name: str, of: Mapping[str, Any]) -> Iterator[str]:
    tables: dict[tuple[int, tuple[str, ...]], list[Row]] = {}
    for keys, figures in rows_of(of):
        tables.setdefault((len(keys), tuple(figures)), []).append((keys, figures))
    for (deep, columns), rows in tables.items():
        head = [name, *[""] * (deep - 1), *columns] if deep else list(columns)
        lines = [[*keys, *map(_cell, figures.values())] for keys, figures in rows]
        yield "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *lines])


def rows_of(of: Mapping[str, Any], keys: tuple[str, ...] = ()) -> Iterator[Row]:
    """(keys, figures) of every place in which figures stand. A mapping of figures alone stands among those beside it:
    `counts frames`."""
    figures: dict[str, Any] = {}
    further = {}
    for key, value in of.items():
        if not isinstance(value, Mapping):
            figures[key] = value
        elif "said" in value:
            figures[key] = value["said"]
        else:
            further[key] = value
    if figures:
        yield keys, figures
    for key, value in further.items():
        yield from rows_of(value, (*keys, str(key)))


def _cell(value: Any) -> str:
    if value is None or value != value:  # NaN
        return ""
    if isinstance(value, Figure):
        return format(value, ".3g")
    if isinstance(value, list | tuple):
        return ", ".join(map(_cell, value))
    return (
        f"{value:,}" if isinstance(value, int) else f"{value:.3g}" if isinstance(value, float) else str(value)
    )
