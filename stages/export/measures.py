"""measures.csv: the take's figures, one a line."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...pipeline.files.atomic import whole_file
from ...pipeline.take import Take
from .provenance import provenance


def write_measures(take: Take, path: Path) -> None:
    """Lines of provenance that begin with "# ", then the columns `measure`, `item` and `value`.

    measure: the keys that lead to the figure in summary.json, joined by dots; its unit ends the last. item: which of
    a list, from 0 on, for a curve over a cycle the per cent; empty for a single figure. value: a number, or words.
    """
    with whole_file(path) as partial, open(partial, "w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {name}: {text}\n" for name, text in provenance(take).items())
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("measure", "item", "value"))
        writer.writerows(_lines(take.measures or {}))


def _lines(group: dict[str, Any], above: tuple[str, ...] = ()) -> Iterator[tuple[str, int | str, Any]]:
    for key, value in group.items():
        path = (*above, key)
        if isinstance(value, dict):
            yield from _lines(value, path)
        elif isinstance(value, list):
            yield from ((".".join(path), item, entry) for item, entry in enumerate(value))
        else:
            yield ".".join(path), "", value
