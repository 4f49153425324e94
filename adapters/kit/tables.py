"""Tables of text, as programs save them for spreadsheets."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from ...pipeline.core.errors import InputError, readable


def filled_lines(path: Path, what: str) -> list[str]:
    """The lines of a text that hold anything, one at least; InputError, saying that `what` was expected."""
    with opened_table(path, what) as file:
        lines = [line for line in file.read().splitlines() if line.strip()]
    if not lines:
        raise InputError("file-damaged", f"Expected {what} in {path}, but it is empty; copy it again.")
    return lines


@contextmanager
def opened_table(path: Path, what: str) -> Iterator[TextIO]:
    """The file, opened for the csv module. what: in words, for InputError when it cannot be read, or is no table."""
    try:
        with readable(path, what), path.open(encoding="utf-8-sig", newline="") as file:
            yield file
    except csv.Error:
        raise InputError(
            "format-unknown", f"Expected {what} in {path}, got a file that is not a text table."
        ) from None
