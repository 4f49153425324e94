"""Reports as pages of Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Table:
    """title: its heading, none where it is "". head, rows: cells, said as `str` says them, or a row's words with " | "
    between its cells. note: words above it."""

    title: str
    head: Sequence[object]
    rows: Iterable[Sequence[object]]
    note: str = ""

    def __str__(self) -> str:
        lines = [f"## {self.title}", ""] if self.title else []
        lines += [self.note, ""] if self.note else []
        rows = [self.head, ["---"] * len(self.head), *self.rows]
        said = (row if isinstance(row, str) else " | ".join(map(str, row)) for row in rows)
        return "\n".join([*lines, *(f"| {row} |" for row in said)])


def page(title: str, about: str, tables: Iterable[Table | str]) -> str:
    """A page: its title, what it is about, and its tables, or words, with an empty line between."""
    return "\n\n".join([f"# {title}", about, *(str(table) for table in tables)]) + "\n"


def settings(results: dict[str, Any]) -> str:
    """The words of sets.heading."""
    words = [f"pcnet3d {results['pcnet3d']}", f"lifter {results['lifter']}"]
    words += [f"seed {results['seed']}"] if "seed" in results else []
    words += [f"flip {'on' if results['flip'] else 'off'}"]
    return ", ".join(words + ([f"{results['bed']} views"] if "bed" in results else []))
