"""JSON files of detectors and lifters: recognised, loaded and unpacked, with errors a user understands."""

from __future__ import annotations

import codecs
import json
import re
import reprlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import from_json

from ...pipeline.core.errors import InputError
from .opened import first_bytes, whole_text

_PEEK_BYTES = 1 << 16  # more than the metadata that MMPose's demos write before the first frame
# Of characters beyond 16 bits, or of names of files that are no text: alone they are none, which pydantic refuses.
_HALVES = re.compile(r"(?<!\\)\\u[dD][89a-fA-F]..")
_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]*$")
# Roboflow's exports put a hash behind the name: walk_mp4-0003_jpg.rf.0f31b2.jpg
_ROBOFLOW = re.compile(r"\.rf\.\w+$")
_MAX_FRAME = 1 << 53  # larger numbers are no video frames, and would not fit an int64


def beginning(path: Path) -> Any:
    """The first 64 KB of a JSON file as Python values, cut at a comma, of JSON Lines as a list of the first ones; None
    for anything else. Never raises."""
    start = first_bytes(path, _PEEK_BYTES)
    try:
        if lines := _lines(start):
            return [*map(json.loads, lines)]
        text = _HALVES.sub("?", start.decode("utf-8-sig", errors="ignore"))
        if text.lstrip()[:1] not in ("[", "{"):
            return None
        try:
            return from_json(text)
        except ValueError:
            return from_json(text[: text.rfind(",")], allow_partial=True)
    except (ValueError, RecursionError):
        return None


def _lines(start: bytes) -> list[bytes]:
    """The whole lines of JSON Lines, one object or list each; none of other JSON."""
    lines = start.removeprefix(codecs.BOM_UTF8).strip().splitlines()
    wholes = [line.strip() for line in lines[: -1 if len(start) == _PEEK_BYTES else None]]
    ends = {b"{": b"}", b"[": b"]"}
    several = len(lines) > 1 and all(line and ends.get(line[:1]) == line[-1:] for line in wholes)
    return wholes if several else []


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
    """The elements of a JSON file: of a list, and of JSON Lines, ("", element) of each; of an object (key, element) of
    each value that is a list, and (key, value) of anything else in it. InputError as for `load`, and for anything
    else."""
    content = load(path, what)
    if not isinstance(content, list | dict):
        raise InputError(
            "format-unknown", f"{path}: expected a list or an object, got {reprlib.repr(content)}."
        )
    held = content if isinstance(content, dict) else {"": content}
    for key, value in held.items():
        if isinstance(value, list):
            yield from ((key, element) for element in value)
        else:
            yield key, value


def field(entry: Any, key: str, where: str) -> Any:
    """entry[key]; InputError when the entry is no JSON object or lacks the key."""
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(
            "wrong-content", f"{where}: expected an object with '{key}', got {reprlib.repr(entry)}."
        )
    return entry[key]


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
