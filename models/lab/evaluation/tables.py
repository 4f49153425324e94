"""Reports as pages of Markdown tables: what a page says is written down beside what is measured, and filled in here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from string import Formatter
from typing import Any


@dataclass(frozen=True)
class Table:
    """Rows out of a report's nested figures.

    path: where they are: keys between "/", and "*" for every key there is, which the row begins with. labels: heads of
    these keys. columns: {head: cell}, the cell a format string of the row's figures and of those above it, such as
    "{rmse:.1f}" or "{error.p50:.1f}", and "{value}" where the path leads to a figure itself. A missing figure is an
    empty cell; several by name are said one after another, and of a list how long it is. title: "" for none. note:
    words above.
    where: of figures, which rows there are.
    """

    title: str
    path: str
    labels: Sequence[str]
    columns: Mapping[str, str]
    note: str = ""
    where: Callable[[Mapping[str, Any]], bool] = lambda row: True


@dataclass(frozen=True)
class Page:
    """A report's page. about: what stands above the tables, a format string of the figures; what every report is asked
    (`settings`) stands before it. tables: tables, and words between them, format strings too."""

    title: str
    about: str
    tables: Sequence[Table | str]


def written(results: Mapping[str, Any], page: Page) -> str:
    """The page of a report's figures, as Markdown."""
    asked = settings(results)
    parts = [f"# {page.title}", asked + filled(page.about, results)]
    for table in page.tables:
        parts.append(filled(table, results) if isinstance(table, str) else _table(table, results))
    return "\n\n".join(part for part in parts if part) + "\n"


def filled(text: str, figures: Mapping[str, Any]) -> str:
    """A format string with these figures; "" in the place of a missing one."""
    return _Cells().vformat(text, (), figures)


def settings(results: Mapping[str, Any]) -> str:
    """The words of Question.heading; "" for a report that is asked otherwise."""
    if not {"lifter", "bed"} & results.keys():
        return ""
    words = [f"pcnet3d {results['pcnet3d']}"]
    words += [f"lifter {results['lifter']}"] if "lifter" in results else []
    words += [f"seed {results['seed']}"] if "seed" in results else []
    words += [f"{results['bed']} views"] if "bed" in results else []
    return ", ".join(words)


def rows_of(figures: Mapping[str, Any], path: str) -> Iterator[tuple[tuple[str, ...], Mapping[str, Any]]]:
    """(the keys in the place of each "*", the figures there and those above) of every row under Table.path."""
    first, _, rest = path.partition("/")
    for key, inside in figures.items() if first == "*" else [(first, figures.get(first))]:
        label = (str(key),) if first == "*" else ()
        if isinstance(inside, list):
            inside = {str(i): part for i, part in enumerate(inside)}
        if not rest and inside is not None:
            yield label, inside if isinstance(inside, Mapping) else {"value": inside}
        if not rest or not isinstance(inside, Mapping):
            continue
        for further, row in rows_of(inside, rest):
            yield (*label, *further), {**inside, **row}


def _table(table: Table, results: Mapping[str, Any]) -> str:
    rows = [
        [*keys[: len(table.labels)], *(filled(cell, row).rstrip("; ") for cell in table.columns.values())]
        for keys, row in rows_of(results, table.path)
        if table.where(row)
    ]
    if not rows:
        return ""
    head = [*table.labels, *table.columns]
    lines = [f"## {table.title}", ""] if table.title else []
    lines += [table.note, ""] if table.note else []
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in [head, ["---"] * len(head), *rows])])


class _Cells(Formatter):
    def get_value(self, key: int | str, args: Any, kwargs: Any) -> Any:
        return kwargs[str(key)]  # "{0}" is the first of a list

    def get_field(self, field_name: str, args: Any, kwargs: Any) -> Any:
        try:
            return super().get_field(field_name, args, kwargs)
        except (KeyError, AttributeError, TypeError):  # a figure that this row does not have
            return None, field_name

    def format_field(self, value: Any, format_spec: str) -> str:
        if value is None or (isinstance(value, float) and math.isnan(value)):
            return ""
        if isinstance(value, Mapping):
            return ", ".join(f"{self.format_field(part, format_spec)} ({key})" for key, part in value.items())
        if isinstance(value, list):
            return str(len(value))
        return super().format_field(value, format_spec)
