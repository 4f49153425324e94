"""JSON files of detectors and lifters: recognised, loaded and unpacked, with errors a user understands."""

from __future__ import annotations

import codecs
import json
import re
import reprlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from pydantic_core import from_json

from ...pipeline.core.errors import InputError
from .opened import first_bytes, opened_text, whole_text

_PEEK_BYTES = 1 << 16  # more than the metadata that MMPose's demos write before the first frame
# Of characters beyond 16 bits, or of names of files that are no text: alone they are none, which pydantic refuses.
_HALVES = re.compile(r"(?<!\\)\\u[dD][89a-fA-F]..")
_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]*$")
# Roboflow's exports put a hash behind the name: walk_mp4-0003_jpg.rf.0f31b2.jpg
_ROBOFLOW = re.compile(r"\.rf\.\w+$")
_SPACE = re.compile(r"[ \t\r\n]*")
_DECODER = json.JSONDecoder()
_PIECE = 1 << 18
_SMALL = 1 << 24  # bytes of a file that is read a second time to find what is wrong with it
_MAX_FRAME = 1 << 53  # larger numbers are no video frames, and would not fit an int64


def beginning(path: Path) -> Any:
    """The first 64 KB of a JSON file as Python values, cut at a comma, of JSON Lines as a list of the first ones; None
    for anything else. Never raises."""
    start = first_bytes(path, _PEEK_BYTES)
    try:
        return [*map(json.loads, _lines(start))] or _cut(start.decode("utf-8-sig", errors="ignore"))
    except (ValueError, RecursionError):
        return None


def _lines(start: bytes) -> list[bytes]:
    """The whole lines of JSON Lines, one object or list each; none of other JSON."""
    lines = start.removeprefix(codecs.BOM_UTF8).strip().splitlines()
    wholes = [line.strip() for line in lines[: -1 if len(start) == _PEEK_BYTES else None]]
    ends = {b"{": b"}", b"[": b"]"}
    several = len(lines) > 1 and all(line and ends.get(line[:1]) == line[-1:] for line in wholes)
    return wholes if several else []


def _cut(text: str) -> Any:
    """What a list or an object holds, of one that goes on behind the text all up to its last comma. ValueError for
    anything else."""
    if text.lstrip()[:1] not in ("[", "{"):
        raise ValueError("expected a list or an object")
    text = _HALVES.sub("?", text)
    try:
        return from_json(text)
    except ValueError:
        return from_json(text[: text.rfind(",")], allow_partial=True)


def load(path: Path, what: str) -> Any:
    """The values of a whole JSON file. InputError, saying that `what` was expected, when it cannot be read."""
    text = whole_text(path, what)
    try:
        return (
            [*map(json.loads, text.splitlines())] if _lines(text[:_PEEK_BYTES].encode()) else json.loads(text)
        )
    except json.JSONDecodeError as error:
        raise InputError(
            "file-damaged",
            f"Expected {what} in {path}, but its JSON is incomplete or damaged at line {error.lineno}, column "
            f"{error.colno}; write or copy the file again.",
        ) from None
    except (RecursionError, ValueError):  # nested too deeply; an integer of thousands of digits
        raise InputError(
            "format-unknown", f"Expected {what} in {path}, got JSON of a kind that no detector writes."
        ) from None


def each(path: Path, what: str) -> Iterator[tuple[str, Any]]:
    """The elements of a long JSON file one after the other, so that it is never in memory as a whole.

    A list gives ("", element) of each, and so do JSON Lines; an object gives (key, element) of each value that is a
    list, and (key, value) of any other. InputError, saying that `what` was expected, when the file cannot be read.
    """
    try:
        lines = bool(_lines(first_bytes(path, _PEEK_BYTES)))
        with opened_text(path, what) as file:
            yield from _one_by_one(_Text(file)) if lines else _elements(_Text(file))
    except InputError:
        raise
    except (RecursionError, ValueError):
        if path.stat().st_size <= _SMALL:  # say where
            raise InputError(
                "format-unknown",
                f"{path}: expected a list or an object, got {reprlib.repr(load(path, what))}.",
            ) from None
        raise InputError(
            "file-damaged",
            f"Expected {what} in {path}, but its JSON is incomplete or damaged; write or copy the file again.",
        ) from None


class _Text:
    """A JSON text that is read piece by piece. ValueError where it is none."""

    def __init__(self, file: IO[str]) -> None:
        self._file, self._text, self._at = file, "", 0

    def peek(self) -> str:
        """The next character that is no white space, "" at the end."""
        while True:
            self._at = _SPACE.match(self._text, self._at).end()  # type: ignore[union-attr]  # matches always
            if self._at < len(self._text) or not self._more():
                return self._text[self._at : self._at + 1]

    def take(self, *wanted: str) -> str:
        character = self.peek()
        if character not in wanted or not character:
            raise ValueError(f"expected {wanted}")
        self._at += 1
        return character

    def value(self) -> Any:
        self.peek()
        while True:
            try:
                value, end = _DECODER.raw_decode(self._text, self._at)
            except json.JSONDecodeError:
                if not self._more():
                    raise
                continue
            if end < len(self._text) or not self._more():  # a number might go on
                self._at = end
                return value

    def _more(self) -> bool:
        """Twice what is left, so that a value of any length is decoded a few times only."""
        piece = self._file.read(max(_PIECE, len(self._text) - self._at))
        self._text, self._at = self._text[self._at :] + piece, 0
        return bool(piece)


def _elements(text: _Text) -> Iterator[tuple[str, Any]]:
    if text.peek() == "[":
        yield from _listed("", text)
    elif text.take("{") and text.peek() != "}":
        while True:
            key = text.value()
            text.take(":")
            if text.peek() == "[":
                yield from _listed(key, text)
            else:
                yield key, text.value()
            if text.take(",", "}") == "}":
                break
    if text.peek():
        raise ValueError("expected the end")


def _one_by_one(text: _Text) -> Iterator[tuple[str, Any]]:
    while text.peek():
        yield "", text.value()


def _listed(key: str, text: _Text) -> Iterator[tuple[str, Any]]:
    text.take("[")
    if text.peek() == "]":
        text.take("]")
        return
    while True:
        yield key, text.value()
        if text.take(",", "]") == "]":
            return


def field(entry: Any, key: str, where: str) -> Any:
    """entry[key]; InputError when the entry is no JSON object or lacks the key."""
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(
            "wrong-content", f"{where}: expected an object with '{key}', got {reprlib.repr(entry)}."
        )
    return entry[key]


def entries(values: Any, where: str) -> list[Any]:
    """The values if they are a list; otherwise InputError."""
    if not isinstance(values, list):
        raise InputError("wrong-content", f"{where}: expected a list, got {reprlib.repr(values)}.")
    return values


def numbers(values: Any, where: str) -> np.ndarray:
    """Nested lists as a float64 array (...,), null as NaN; InputError for anything but finite numbers in equal
    lengths."""
    try:
        array = np.array(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        array = np.array(np.inf)
    if np.isinf(array).any():
        raise InputError(
            "wrong-content",
            f"{where}: expected finite numbers in lists of equal length, got {reprlib.repr(values)}.",
        )
    return array


def stem(image: str) -> str:
    """An image's or file's name without what kind of file it is."""
    return _ROBOFLOW.sub("", _SUFFIX.sub("", image))


def frame_number(image: Any, where: str) -> int:
    """The video frame of an image: the number itself, or the last number in a name such as "clip_0012.jpg". InputError
    for anything else."""
    number = image
    if isinstance(image, str):
        digits = re.findall(r"0*([0-9]+)", stem(image))
        number = int(digits[-1]) if digits and len(digits[-1]) < 20 else None
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < _MAX_FRAME:
        raise InputError(
            "wrong-content",
            f'{where}: expected an image that is numbered by its video frame, such as 12 or "12.jpg", '
            f"got {reprlib.repr(image)}.",
        )
    return number
