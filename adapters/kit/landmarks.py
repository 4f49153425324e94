"""MediaPipe's 33 landmarks out of tables that people save: one row a frame, or one row a landmark (formats.md 5)."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import BLAZEPOSE33
from .tables import opened_table

COUNT = len(BLAZEPOSE33)

_AXES = {"x": 0, "y": 1, "z": 2, "visibility": 3, "vis": 3, "v": 3}
_NUMBERED = re.compile(r"^(?:landmark|lm|kp|joint|point|p)?_?(\d{1,3})_([a-z]+)$|^([a-z]+)_?(\d{1,3})$")
_FRAME = ("frame", "frame_id", "frame_index", "frame_idx", "frame_number", "frame_no", "frame_num")
_SECONDS = {
    **dict.fromkeys(("time_s", "timestamp_s", "seconds", "time_sec", "timestamp_sec"), 1.0),
    **dict.fromkeys(("time_ms", "timestamp_ms", "milliseconds"), 1e-3),
    **dict.fromkeys(("time_us", "timestamp_us"), 1e-6),
}
_LANDMARK = ("landmark", "landmark_id", "landmark_index", "landmark_idx", "landmark_name")


@dataclass(frozen=True, eq=False)
class Body:
    """One person in one frame. values: (33, 4) x, y, z and visibility (NaN without).

    frame: the frame's number, None when the file does not say; time_s: seconds, None alike. box: (4,) in the
    image, None when unknown.
    """

    values: np.ndarray
    frame: int | None = None
    time_s: float | None = None
    box: np.ndarray | None = None


@dataclass(frozen=True)
class _Columns:
    """Where a table has what. values: column of (landmark, axis); landmark: the column that names it, if one does."""

    values: dict[tuple[int, int], int]
    frame: int | None = None
    time: tuple[int, float] | None = None
    landmark: int | None = None


def spelled(joint: str) -> str:
    """MediaPipe's own name of a joint in small letters, such as left_eye_inner and mouth_left."""
    side = {"l_": "left", "r_": "right"}.get(joint[:2])
    if side is None:
        return joint
    return f"mouth_{side}" if joint[2:] == "mouth" else f"{side}_{joint[2:]}"


NAMES = {spelled(joint): i for i, joint in enumerate(BLAZEPOSE33.joints)}


def seconds(name: str, value: float) -> float | None:
    """Seconds from a field of that name, None when it is none of a known unit."""
    factor = _SECONDS.get(name.lower())
    return None if factor is None else value * factor


def is_table(path: Path) -> bool:
    """Whether the first line of a text file is a header, or a row, of such a table. Never raises."""
    try:
        if not path.is_file():
            return False
        with path.open(encoding="utf-8-sig") as file:
            first = file.readline(1 << 16)
            return _columns(_cells(first, _delimiter(first))) is not None
    except (OSError, ValueError, csv.Error):
        return False


def table(path: Path) -> Iterator[Body]:
    """Everybody in the table, row by row. InputError when it is none, or has a cell that is no number."""
    with opened_table(path, "MediaPipe's landmarks") as file:
        first = file.readline()
        delimiter = _delimiter(first)
        cells = _cells(first, delimiter)
        columns = _columns(cells)
        if columns is None:
            raise InputError(
                "wrong-content",
                f"{path}: expected MediaPipe's 33 landmarks, with columns x, y, z (and visibility) of each in one "
                "row, or a row a landmark with frame, landmark, x, y, z.",
            )
        if _numeric(cells):
            file.seek(0)
        rows = enumerate(csv.reader(file, delimiter=delimiter), 1 if _numeric(cells) else 2)
        filled = ((i, row) for i, row in rows if any(cell.strip() for cell in row))
        yield from (
            _long(filled, columns, path) if columns.landmark is not None else _wide(filled, columns, path)
        )


def _delimiter(line: str) -> str:
    return max(",;\t", key=line.count)


def _cells(line: str, delimiter: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])]


def _numeric(cells: list[str]) -> bool:
    try:
        return bool([float(cell) for cell in cells])
    except ValueError:
        return False


def _columns(cells: list[str]) -> _Columns | None:
    if _numeric(cells):
        return _without_header(len(cells))
    names = [re.sub(r"[^a-z0-9]+", "_", cell.lower()).strip("_") for cell in cells]
    frame = next((names.index(name) for name in _FRAME if name in names), None)
    time = next(((i, _SECONDS[name]) for i, name in enumerate(names) if name in _SECONDS), None)
    left_out = ("world", "pose", "m")  # metres
    short = ["_".join(part for part in name.split("_") if part not in left_out) for name in names]
    if any("world" in name for name in names):  # a file may hold the image's landmarks beside these
        short = [
            part if "world" in name or name in _LANDMARK else name if _AXES.get(name) == 3 else ""
            for name, part in zip(names, short, strict=True)
        ]
    landmark = next((names.index(name) for name in _LANDMARK if name in names), None)
    if landmark is not None and {"x", "y", "z"} <= set(short):
        places = {(0, _AXES[name]): i for i, name in enumerate(short) if name in _AXES}
        return _Columns(places, frame, time, landmark) if frame is not None or time is not None else None
    return _wide_columns(short, frame, time)


def _without_header(width: int) -> _Columns | None:
    for first, frame in ((0, None), (1, 0)):  # some write the frame's number before the landmarks
        each, odd = divmod(width - first, COUNT)
        if each in (3, 4, 5) and not odd:
            return _Columns(
                {(i, axis): first + each * i + axis for i in range(COUNT) for axis in range(min(each, 4))},
                frame,
            )
    return None


def _wide_columns(names: list[str], frame: int | None, time: tuple[int, float] | None) -> _Columns | None:
    named, numbered = {}, {}
    for i, name in enumerate(names):
        landmark, _, axis = name.rpartition("_")
        if landmark in NAMES and axis in _AXES:
            named[NAMES[landmark], _AXES[axis]] = i
        elif match := _NUMBERED.match(name):
            number, axis = match[1] or match[4], match[2] or match[3]
            if axis in _AXES:
                numbered[int(number), _AXES[axis]] = i
    if numbered and min(number for number, _ in numbered) == 1:  # x1 to x33
        numbered = {(number - 1, axis): i for (number, axis), i in numbered.items()}
    for places in (named, numbered):
        if {(i, axis) for i in range(COUNT) for axis in range(3)} <= places.keys():
            return _Columns({place: i for place, i in places.items() if place[0] < COUNT}, frame, time)
    return None


def _number(row: list[str], column: int, where: str) -> float:
    try:
        return float(row[column]) if row[column].strip() else float("nan")
    except (IndexError, ValueError):
        found = repr(row[column]) if column < len(row) else "the end of the line"
        raise InputError(
            "wrong-content", f"{where}, column {column + 1}: expected a number, got {found}."
        ) from None


def _when(row: list[str], columns: _Columns, where: str) -> tuple[int | None, float | None]:
    frame = None if columns.frame is None else _number(row, columns.frame, where)
    if frame is not None and (not 0 <= frame < 1 << 53 or frame != int(frame)):
        raise InputError(
            "wrong-content", f"{where}: expected a frame's number, got {row[columns.frame or 0]!r}."
        )
    time = None if columns.time is None else _number(row, columns.time[0], where) * columns.time[1]
    return (None if frame is None else int(frame)), time


def _wide(rows: Iterator[tuple[int, list[str]]], columns: _Columns, path: Path) -> Iterator[Body]:
    for line, row in rows:
        where = f"{path}, line {line}"
        values = np.full((COUNT, 4), np.nan)
        for place, column in columns.values.items():
            values[place] = _number(row, column, where)
        yield Body(values, *_when(row, columns, where))


def _long(rows: Iterator[tuple[int, list[str]]], columns: _Columns, path: Path) -> Iterator[Body]:
    """Rows of one frame belong together; a landmark that comes again begins the next person."""
    values, when, taken = np.full((COUNT, 4), np.nan), None, set()
    for line, row in rows:
        where = f"{path}, line {line}"
        said = row[columns.landmark or 0].strip() if len(row) > (columns.landmark or 0) else ""
        landmark = NAMES.get(
            said.lower().removeprefix("poselandmark."),
            int(said) if said.isdecimal() and len(said) < 4 else -1,
        )
        if not 0 <= landmark < COUNT:
            raise InputError(
                "wrong-content",
                f"{where}: expected one of MediaPipe's 33 landmarks by name or number, got {said!r}.",
            )
        now = _when(row, columns, where)
        if taken and (now != when or landmark in taken):
            yield Body(values, *(when or (None, None)))
            values, taken = np.full((COUNT, 4), np.nan), set()
        for (_, axis), column in columns.values.items():
            values[landmark, axis] = _number(row, column, where)
        taken.add(landmark)
        when = now
    if taken:
        yield Body(values, *(when or (None, None)))
