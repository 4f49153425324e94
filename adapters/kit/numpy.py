"""Arrays out of strangers' .npy and .npz files (pipeline/files/arrays.py), as adapters look at them.

Where a format stores Python objects, a reader that runs nothing takes them apart (adapters/kit/pickles.py).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.files.arrays import (
    Shape,
    damage_reported,
    fits,
    header,
    in_words,
    keys,
    load,
    load_all,
    opened,
)
from .pickles import loads

_PEEK_BYTES = 1 << 22
_BEGINNING = 1 << 16

__all__ = [
    "Shape",
    "arrays_in",
    "fits",
    "has_objects",
    "in_words",
    "keys",
    "load",
    "load_all",
    "load_objects",
    "objects_begin",
    "peek",
    "shape_in",
]


def load_objects(path: Path, key: str) -> Any:
    """The Python objects of an .npz's array `key`, as lists, dicts, texts, numbers and arrays; the one object of an
    array of shape (). InputError for an array of anything else, and for objects that would have to be called.
    """
    where = f"{path}, array '{key}'"
    with damage_reported(path), opened(path, key) as (stream, _):
        shape, _, dtype = header(stream, where)
        if not dtype.hasobject:
            raise InputError(f"{where}: expected Python objects, got an array of shape {shape} of {dtype}.")
        content = stream.read()
    return loads(content, where)


def arrays_in(path: Path) -> set[str]:
    """The names of the arrays in an .npz; none for any other file. Never raises."""
    try:
        return set(keys(path))
    except InputError:
        return set()


def objects_begin(path: Path, key: str) -> bytes:
    """The first 64 KB of the pickle of Python objects in an .npz's array `key`; none of any other array. Never
    raises."""
    try:
        with damage_reported(path), opened(path, key) as (stream, _):
            return stream.read(_BEGINNING) if header(stream, str(path))[2].hasobject else b""
    except InputError:
        return b""


def shape_in(path: Path, key: str) -> tuple[int, ...]:
    """The shape that the header of an .npz's array `key` says; () where it cannot be read. Never raises."""
    try:
        with damage_reported(path), opened(path, key) as (stream, _):
            return header(stream, str(path))[0]
    except InputError:
        return ()


def has_objects(path: Path, *wanted: str) -> bool:
    """Whether the file is an .npz with arrays of Python objects by these names. Never raises."""
    try:
        if not arrays_in(path) >= set(wanted):
            return False
        for key in wanted:
            with damage_reported(path), opened(path, key) as (stream, _):
                if not header(stream, str(path))[2].hasobject:
                    return False
    except InputError:
        return False
    return True


def peek(path: Path, *shapes: Shape, key: str | None = None) -> np.ndarray | None:
    """The first rows of what `load` gives, (...,) of one of the shapes, or None where it would raise: for sniffing. At
    most 4 MB are read, which are 20,000 rows of 17 joints; data of a wrong shape are never read."""
    try:
        return load(path, *shapes, key=key, limit=_PEEK_BYTES)
    except InputError:
        return None
