"""Tables of points over time, as programs and people save them for spreadsheets: a column or a row for each point.

A column says by its name which coordinate of which point it holds ("left_knee_x", "x12", "LKnee.likelihood"), or when a
row was seen (kit/clock.py); DeepLabCut's tables say it in three lines or four. Cells are separated by semicolons, tabs,
commas or blanks; where it is no comma, numbers may have decimal commas. What is missing is empty, NaN, NA, None, null.
"""

from __future__ import annotations

import csv
import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.files.opened import first_lines, opened_text
from .clock import Clock, Moments, kind_of, of_kind, plain

_AXIS = {
    **{name: i for i, axis in enumerate("xyz") for name in (axis, f"3d{axis}", f"2d{axis}")},
    **dict.fromkeys(
        ("score", "visibility", "vis", "v", "conf", "confidence", "likelihood", "prob", "c", "s"), 3
    ),
}
_SCORE = 3
_LEFT_OUT = ("world", "pose", "m", "px")  # of a column's name, beside point and axis
_NUMBERED = re.compile(r"([a-z]+)_?0*(\d{1,3})|0*(\d{1,3})_([a-z]+)")
_POINT = re.compile(r"(?:landmark|lm|kp|kpt|keypoint|joint|point|p)?_?0*(\d{1,3})")
_LABEL = re.compile(
    r"(landmark|keypoint|joint|bodypart|body_part|part|point|marker|kp|kpt)(_id|_index|_idx|_name|_number)?"
)
_STACKED = ("scorer", "individuals", "bodyparts", "coords")  # what lines of DeepLabCut's header begin with
_MISSING = {"", "nan", "na", "n/a", "#n/a", "none", "null", "nil", "-"}
_DIGITS = {*"+-,0123456789"}  # that a number begins with
_PEEK_BYTES = 1 << 16


@dataclass(frozen=True, eq=False)
class Points:
    """What a table holds of points. names (P,): plain, a number for one that is numbered, from 0. values: (N, P, 4) x,
    y, z and score of each sighting, NaN where there is none. moments (N,): of `clock`. people (N,): each sighting's
    person, None where the file names nobody."""

    names: tuple[str, ...]
    values: np.ndarray
    moments: np.ndarray
    people: tuple[str | None, ...]
    clock: Clock


@dataclass(frozen=True)
class _Column:
    point: str
    axis: int
    person: str | None = None


@dataclass(frozen=True)
class Header:
    """Where a table has what. names: of all columns, as they are written; values: those of coordinates; lines: before
    the first row; label: the column that names the point of a row, None where a row has all points; person, clocks:
    those that say whose and when."""

    names: tuple[str, ...]
    values: dict[int, _Column]
    delimiter: str
    lines: int
    label: int | None = None
    person: int | None = None
    clocks: tuple[int, ...] = (0,)
    labels: frozenset[str] = frozenset()

    @property
    def points(self) -> set[str]:
        """The points of which the columns are, or the first rows."""
        return {column.point for column in self.values.values()} if self.label is None else {*self.labels}

    @property
    def dims(self) -> int:
        """How many coordinates a point has: 2 or 3; 0 where not all points have x and y."""
        by_point: dict[str, set[int]] = {}
        for column in self.values.values():
            by_point.setdefault(column.point, set()).add(column.axis)
        axes = set.intersection(*by_point.values()) if by_point else set()
        return 3 if {0, 1, 2} <= axes else 2 if {0, 1} <= axes else 0


def header_of(path: Path) -> Header | None:
    """What the first lines of a text say of a table of points; None for anything else. Never raises."""
    lines = [line for line in first_lines(path, _PEEK_BYTES) if line.strip()]
    if not lines or lines[0].lstrip("\ufeff ")[:1] in "{[":  # JSON, a line of which may have 100,000 commas
        return None
    delimiter = _delimiter(lines[0])
    rows = [_cells(line, delimiter) for line in lines[: len(_STACKED) + 1]]
    stacked = {row[0].lower(): row[1:] for row in rows if row and row[0].lower() in _STACKED}
    header = _stacked(stacked, delimiter) if stacked else _named(rows[0], delimiter)
    if header is None or header.label is None:
        return header
    labels = (_row_label(_cells(line, delimiter), header) for line in lines[1:-1])
    return replace(header, labels=frozenset(labels))


def read_points(path: Path, what: str, only: Mapping[str, tuple[str, ...]] | None = None) -> Points:
    """Everybody in a table. only: cells of columns by their names, where they are there; rows with other cells are left
    out.

    InputError, saying that `what` was expected, for what is no table of points, for a cell that is no number, and as
    for `Moments`.
    """
    header, moments = header_of(path), Moments(str(path))
    if header is None:
        raise InputError(
            "wrong-content", f"Expected {what} in {path}, got no table whose first line names points."
        )
    wanted = {header.names.index(name): cells for name, cells in (only or {}).items() if name in header.names}
    at, data, label_of = array("q"), array("f"), array("q")  # of each row
    people: list[str | None] = []
    labels: dict[str, int] = {}  # numbers of the points, where a row is one
    for where, row in _rows(path, what, header.delimiter, header.lines):
        if any(_cell(row, column) not in cells for column, cells in wanted.items()):
            continue
        cell = _cell(row, header.person)
        people.append(None if cell.lower() in (*_MISSING, "-1") else cell)
        clock_cells = {header.names[i]: row[i] for i in header.clocks if i < len(row)}
        at.append(moments.of(clock_cells, where, people[-1]))
        data.extend([_number(row, i, header.names, where) for i in header.values])
        if header.label is not None:
            label_of.append(labels.setdefault(_row_label(row, header), len(labels)))
    values = np.frombuffer(data, np.float32).reshape(len(at), len(header.values))
    if len(set(people)) == len(people) > 2:  # numbers of rows
        people = [None] * len(people)
    columns = list(header.values.values())
    points, sighting, first = tuple(labels), np.arange(len(at)), np.arange(len(at))
    if header.label is None:
        points = tuple(dict.fromkeys(column.point for column in columns))
    else:
        sighting, first = _sightings(at, people, label_of)
    everybody = list(dict.fromkeys(column.person for column in columns))  # of rows with several people
    held = np.full((len(everybody), len(first), len(points), 4), np.nan, np.float32)
    for i, column in enumerate(columns):
        point = points.index(column.point) if header.label is None else label_of
        held[everybody.index(column.person), sighting, point, column.axis] = values[:, i]
    owners = [people[row] for row in first]
    if everybody != [None]:
        owners = [person for person in everybody for _ in first]
    seen = np.tile(np.asarray(at)[first], len(everybody))
    return Points(points, held.reshape(len(seen), len(points), 4), seen, tuple(owners), moments.clock())


def column_names(path: Path) -> list[str]:
    """The names in a table's first line, in lower case; none of anything else. Never raises."""
    first = next(iter(first_lines(path, _PEEK_BYTES)), "")
    return [name.lower() for name in _cells(first, _delimiter(first))]


def read_columns(path: Path, what: str, wanted: Sequence[str]) -> dict[str, np.ndarray]:
    """Columns of numbers (T,) by their lower-case names, those of `wanted` that are there, NaN where a cell is missing.
    InputError, saying that `what` was expected, for a cell that is no number."""
    names = column_names(path)
    columns = {name: names.index(name) for name in wanted if name in names}
    delimiter = _delimiter(next(iter(first_lines(path, _PEEK_BYTES)), ""))
    rows = [
        [_number(row, column, names, where) for column in columns.values()]
        for where, row in _rows(path, what, delimiter, 1)
    ]
    return dict(
        zip(columns, np.array(rows, dtype=np.float64).reshape(len(rows), len(columns)).T, strict=True)
    )


def _rows(path: Path, what: str, delimiter: str, header_lines: int) -> Iterator[tuple[str, list[str]]]:
    """Where each row behind the header is, and its cells, numbers with decimal points."""
    with opened_text(path, what) as file:
        try:
            for line, row in enumerate(csv.reader(file, delimiter=delimiter, skipinitialspace=True), 1):
                cells = [cell.strip() for cell in row]
                if delimiter != ",":
                    cells = [cell.replace(",", ".") if cell[:1] in _DIGITS else cell for cell in cells]
                if line > header_lines and any(cells):
                    yield f"{path}, line {line}", cells
        except csv.Error:
            raise InputError(
                "format-unknown", f"Expected {what} in {path}, got a file that is not a text table."
            ) from None


def _delimiter(line: str) -> str:
    return next((mark for mark in ";\t," if mark in line), " ")


def _cells(line: str, delimiter: str) -> list[str]:
    """None of a line that no table has."""
    try:
        row = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        return []
    return [cell.strip() for cell in row]


def _stacked(by: Mapping[str, list[str]], delimiter: str) -> Header | None:
    """Of DeepLabCut: lines of scorers, maybe of individuals, of points and of axes, by what they begin with."""
    if not {"bodyparts", "coords"} <= by.keys() or len(by["bodyparts"]) != len(by["coords"]):
        return None
    people = by.get("individuals", [])
    values = {
        i + 1: _Column(_label(point), _AXIS[axis], people[i] if i < len(people) else None)
        for i, (point, axis) in enumerate(zip(by["bodyparts"], map(str.lower, by["coords"]), strict=True))
        if axis in _AXIS
    }
    names = ("frame", *(f"{point}_{axis}" for point, axis in zip(by["bodyparts"], by["coords"], strict=True)))
    return Header(names, values, delimiter, len(by))


def _named(written: Sequence[str], delimiter: str) -> Header | None:
    """Of a line of names."""
    names = tuple(name.lstrip("# ") for name in written)
    plain_names = [plain(name) for name in names]
    label = next((i for i, name in enumerate(plain_names) if _LABEL.fullmatch(name)), None)
    person = next((names.index(name) for name in of_kind("person", names)), None)
    coordinates = [i for i, name in enumerate(plain_names) if kind_of(name) in ("", "like") and _column(name)]
    world = any("world" in name for name in plain_names)  # the image's coordinates may stand beside these
    values: dict[int, _Column] = {}
    for i in coordinates:
        column = _column("_".join(part for part in plain_names[i].split("_") if part not in _LEFT_OUT))
        if column is None or bool(column.point) != (label is None):
            continue
        if not world or "world" in plain_names[i] or column.axis == _SCORE:
            values[i] = column
    placed = {column.point for column in values.values() if column.axis != _SCORE}
    values = {i: each for i, each in values.items() if each.point in placed}  # not SLEAP's instance.score
    numbered = {i: column for i, column in values.items() if _POINT.fullmatch(column.point)}
    if min((int(column.point) for column in numbered.values()), default=0) == 1:  # x1 to x33
        values |= {i: _Column(str(int(column.point) - 1), column.axis) for i, column in numbered.items()}
    is_clock = [kind_of(name) not in ("", "person") for name in names]
    clocks = tuple(i for i in range(len(names)) if is_clock[i] and i not in coordinates and i != label)
    if not values or (label is not None and not clocks):
        return None
    return Header(names, values, delimiter, 1, label, person, clocks)


def _column(name: str) -> _Column | None:
    """The coordinate that a column holds, of no point ("") where a row has one; None for any other column."""
    first, _, after = name.partition("_")
    before, _, last = name.rpartition("_")
    if last in _AXIS:
        return _Column(_label(before), _AXIS[last])
    if first in _AXIS and after:
        return _Column(_label(after), _AXIS[first])
    if (match := _NUMBERED.fullmatch(name)) and (axis := match[1] or match[4]) in _AXIS:
        return _Column(str(int(match[2] or match[3])), _AXIS[axis])
    return None


def _label(name: str) -> str:
    """A point's plain name, or the number that it consists of."""
    word = plain(name)
    match = _POINT.fullmatch(word)
    return str(int(match[1])) if match else word


def _sightings(
    at: Sequence[int], people: Sequence[str | None], labels: Sequence[int]
) -> tuple[np.ndarray, list[int]]:
    """Of rows with a point each, (N,) the number of the sighting that each belongs to, and the first row of each: a
    point that comes again in a moment is the next person's."""
    sighting, first, points = np.zeros(len(at), dtype=np.int64), [], set()
    for row, label in enumerate(labels):
        if not row or at[row] != at[row - 1] or people[row] != people[row - 1] or label in points:
            first.append(row)
            points = set()
        points.add(label)
        sighting[row] = len(first) - 1
    return sighting, first


def _row_label(row: list[str], header: Header) -> str:
    """The point of a row of its own."""
    return _label(_cell(row, header.label).lower().removeprefix("poselandmark."))


def _cell(row: list[str], column: int | None) -> str:
    return row[column] if column is not None and column < len(row) else ""


def _number(row: list[str], column: int, names: Sequence[str], where: str) -> float:
    cell = row[column] if column < len(row) else "the end of the line"
    try:
        return float(cell)
    except ValueError:
        if cell.lower() in _MISSING:
            return float("nan")
        name = f" ('{names[column]}')" * bool(names[column])
        raise InputError(
            "wrong-content", f"{where}, column {column + 1}{name}: expected a number, got {cell!r:.60}."
        ) from None
