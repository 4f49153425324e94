"""JSON files of 2D detectors: peeked at to recognise them, loaded and unpacked with errors a user understands."""

from __future__ import annotations

import json
import re
import reprlib
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.errors import InputError

_PEEK_BYTES = 1 << 16  # more than the metadata that MMPose's demos write before the first frame
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"?|[\[\]{},]', re.DOTALL)
_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]*$")
_MAX_FRAME = 1 << 53  # larger numbers are no video frames, and would not fit an int64


def beginning(path: Path) -> Any:
    """The first 64 KB of a JSON file as Python values, cut at a comma; None for anything else. Never raises."""
    try:
        if not path.is_file():
            return None
        with path.open("rb") as file:
            text = file.read(_PEEK_BYTES).decode("utf-8-sig", errors="ignore")
        return json.loads(_closed(text))
    except (OSError, ValueError, RecursionError):
        return None


def first_detection(content: Any) -> dict[str, Any] | None:
    """The first entry of a flat list of detections in images, as COCO defined it; None for anything else."""
    entry = content[0] if isinstance(content, list) and content else None
    return entry if isinstance(entry, dict) and {"image_id", "keypoints"} <= entry.keys() else None


def _closed(text: str) -> str:
    """The text up to its last comma, with the brackets that are open there closed; unchanged if none stays open."""
    closers, comma = _scanned(text)
    return text[:comma] + _scanned(text[:comma])[0] if closers else text


def _scanned(text: str) -> tuple[str, int]:
    """The brackets that would close what the text leaves open, and the place of its last comma (0 without)."""
    closers: list[str] = []
    comma = 0
    for token in _TOKEN.finditer(text):
        match token.group():
            case "[":
                closers.append("]")
            case "{":
                closers.append("}")
            case "]" | "}" if closers:
                closers.pop()
            case ",":
                comma = token.start()
    return "".join(reversed(closers)), comma


def load(path: Path, what: str) -> Any:
    """The values of a whole JSON file. InputError, saying that `what` was expected, when it cannot be read."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"Expected {what} at {path}: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"Expected {what} in {path}, got bytes that are no UTF-8 text.") from None
    if not text.strip():
        raise InputError(f"Expected {what} in {path}, but the file is empty.")
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(
            f"Expected {what} in {path}, but its JSON breaks off or is damaged at line {error.lineno}, column "
            f"{error.colno}; write or copy the file again."
        ) from None
    except (RecursionError, ValueError):  # nested too deeply; an integer of thousands of digits
        raise InputError(f"Expected {what} in {path}, got JSON of a kind that no detector writes.") from None


def field(entry: Any, key: str, where: str) -> Any:
    """entry[key]; InputError when the entry is no JSON object or lacks the key."""
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(f"{where}: expected an object with '{key}', got {reprlib.repr(entry)}.")
    return entry[key]


def entries(values: Any, where: str) -> list[Any]:
    """The values if they are a list; otherwise InputError."""
    if not isinstance(values, list):
        raise InputError(f"{where}: expected a list, got {reprlib.repr(values)}.")
    return values


def numbers(values: Any, where: str) -> np.ndarray:
    """Nested lists as a float64 array, null as NaN; InputError for anything but finite numbers in equal lengths."""
    try:
        array = np.array(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        array = np.array(np.inf)
    if np.isinf(array).any():
        raise InputError(
            f"{where}: expected finite numbers in lists of equal length, got {reprlib.repr(values)}."
        )
    return array


def frame_number(image: Any, where: str) -> int:
    """The video frame of an image: the number itself, or the last number in a name such as "clip_0012.jpg"."""
    number = image
    if isinstance(image, str):
        digits = re.findall(r"0*([0-9]+)", _SUFFIX.sub("", image))
        number = int(digits[-1]) if digits and len(digits[-1]) < 20 else None
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < _MAX_FRAME:
        raise InputError(
            f'{where}: expected an image that is numbered by its video frame, such as 12 or "12.jpg", '
            f"got {reprlib.repr(image)}."
        )
    return number
