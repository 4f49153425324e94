"""Strangers' .npy and .npz files (pipeline/files/arrays.py) as adapters look at them.

Where a format stores Python objects, a reader that runs nothing takes them apart (adapters/kit/pickles.py).
"""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.files.arrays import Shape, arrays_in, fits, in_words, load, opened
from .pickles import loads

_PEEK_BYTES = 1 << 22
_BEGINNING = 1 << 16


def shaped(values: Any, where: str, *shapes: Shape, kinds: str = "fiu") -> np.ndarray:
    """The values (...,). InputError, beginning with `where`, unless they are an array of numbers of one of these
    shapes, not empty, and none of them infinite. kinds: of their dtype."""
    array = values if isinstance(values, np.ndarray) else np.zeros(())
    fit = array.size > 0 and any(fits(array.shape, shape) for shape in shapes)
    if array.dtype.kind not in kinds or not fit or np.isinf(array).any():
        raise InputError(
            "wrong-content",
            f"{where}: expected finite numbers of shape {' or '.join(map(in_words, shapes))}, got {array.shape} of "
            f"{array.dtype}.",
        )
    return array


def load_objects(path: Path, key: str) -> Any:
    """The Python objects of an .npz's array `key`, as lists, dicts, texts, numbers and arrays; the one object of an
    array of shape (). InputError for an array of anything else, and for objects that would have to be called.
    """
    where = f"{path}, array '{key}'"
    with opened(path, key) as (shape, _, dtype, stream, _):
        if not dtype.hasobject:
            raise InputError(
                "wrong-content",
                f"{where}: expected Python objects, got an array of shape {shape} of {dtype}.",
            )
        content = stream.read()
    return loads(content, where)


def begins(path: Path, key: str | None) -> tuple[tuple[int, ...], bytes]:
    """Of an .npz's array `key`, or an .npy's without one, the shape that its header says, and of Python objects the
    first 64 KB of their pickle; () and none where it cannot be read. Never raises."""
    try:
        with opened(path, key) as (shape, _, dtype, stream, _):
            return shape, stream.read(_BEGINNING) if dtype.hasobject else b""
    except InputError:
        return (), b""


def has_objects(path: Path, *wanted: str) -> bool:
    """Whether the file is an .npz with arrays of Python objects by these names. Never raises."""
    return arrays_in(path) >= set(wanted) and all(begins(path, key)[1] for key in wanted)


def plain_array(path: Path, *shapes: Shape, key: str | None = None, limit: int | None = None) -> np.ndarray:
    """As `load`, (...,) of one of the shapes; the file may have more axes of length 1: a batch, or a person."""
    shape = begins(path, key)[0]
    for drop in ((), *((axis,) for axis in range(len(shape))), *combinations(range(len(shape)), 2)):
        cut = tuple(length for axis, length in enumerate(shape) if axis not in drop)
        if all(shape[axis] == 1 for axis in drop) and any(fits(cut, wanted) for wanted in shapes):
            return load(path, shape, key=key, limit=limit).squeeze(drop)
    return load(path, *shapes, key=key, limit=limit)  # says what was expected


def peek(path: Path, *shapes: Shape, key: str | None = None) -> np.ndarray | None:
    """The first rows of what `load` gives, (...,) of one of the shapes, or None where it would raise: for sniffing. At
    most 4 MB are read, which are 20,000 rows of 17 joints; data of a wrong shape are never read."""
    try:
        return plain_array(path, *shapes, key=key, limit=_PEEK_BYTES)
    except InputError:
        return None
