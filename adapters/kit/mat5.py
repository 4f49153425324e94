"""Arrays of numbers, and cells of such arrays, in MATLAB's files of version 5 to 7 ("MAT-File Format", MathWorks).

scipy's reader ends the whole program on some damaged files, so strangers' files are read here: every length is
compared with what is there before it is used. Texts, structures, complex and sparse matrices are not read.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from mmap import mmap
from typing import NamedTuple

import numpy as np

from ...pipeline.core.messages import how_many
from ...pipeline.files.unpacked import unpacked

_HEADER = 128
_COMPRESSED = 15
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CELL = 1
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_COMPLEX = 0x08
_START = 1024  # bytes of a variable in which its name is


class _Matrix(NamedTuple):
    """kind: its class, one of _CLASSES or _CELL. rest: its elements behind the name."""

    kind: int
    complex: bool
    shape: tuple[int, ...]
    name: str
    rest: memoryview


def names(content: bytes | mmap) -> frozenset[str]:
    """Of the variables. ValueError or zlib.error for a damaged file."""
    order = _order(content)
    return frozenset(
        _matrix(_beginning(*element), order).name for element in _elements(_body(content), order)
    )


def arrays(content: bytes, wanted: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The wanted variables that are there: real numbers (...,), or cells of them as an array (...,) of objects.

    ValueError, EOFError or zlib.error for a damaged file or other kinds of values; InputError for one that unpacks to
    many times its size.
    """
    order, found = _order(content), {}
    for kind, data in _elements(_body(content), order):
        name = _matrix(_beginning(kind, data), order).name
        if name in wanted:
            whole = memoryview(unpacked(bytes(data), "a .mat file"))[8:] if kind == _COMPRESSED else data
            matrix = _matrix(whole, order)
            found[name] = _cells(matrix, order) if matrix.kind == _CELL else _numbers(matrix, order)
    return found


def _order(content: bytes | mmap) -> str:
    order = {b"IM": "<", b"MI": ">"}.get(content[126:_HEADER])
    if order is None:
        raise ValueError("its header is damaged")
    return order


def _body(content: bytes | mmap) -> memoryview:
    return memoryview(content)[_HEADER:]


def _beginning(kind: int, data: memoryview) -> memoryview:
    """Of a variable: its first bytes, unpacked."""
    if kind == _COMPRESSED:
        return memoryview(zlib.decompressobj().decompress(bytes(data[: 2 * _START]), _START))[8:]
    return data


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Type and data of each element: 8 bytes of type and length, or of both and up to 4 bytes of data."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise ValueError("it breaks off")
        kind, size = (int(number) for number in np.frombuffer(data[at : at + 8], f"{order}u4"))
        begin = at + 8
        if kind >> 16:
            kind, size, begin = kind & 0xFFFF, kind >> 16, at + 4
        # A matrix whose beginning alone was unpacked is cut; what is behind its name is not looked at then.
        yield kind, data[begin : begin + size]
        at = at + 8 if begin == at + 4 else begin + size + (0 if kind == _COMPRESSED else -size % 8)


def _matrix(data: memoryview, order: str) -> _Matrix:
    elements = _elements(data, order)
    try:
        (_, flags), (_, dims), (_, name) = (next(elements) for _ in range(3))
    except RuntimeError:  # a StopIteration inside a generator
        raise ValueError("a variable is incomplete") from None
    word = int(np.frombuffer(flags[:4], f"{order}u4")[0]) if len(flags) == 8 else 0
    shape = tuple(int(n) for n in np.frombuffer(dims, f"{order}i4"))
    if not 2 <= len(shape) <= 32 or min(shape) < 0:
        raise ValueError(f"it has a variable of shape {shape}")
    behind = sum(-len(part) % 8 + len(part) + 8 if len(part) > 4 else 8 for part in (flags, dims, name))
    return _Matrix(
        word & 0xFF, bool(word >> 8 & _COMPLEX), shape, bytes(name).decode("latin1"), data[behind:]
    )


def _numbers(matrix: _Matrix, order: str) -> np.ndarray:
    stored, data = next(_elements(matrix.rest, order), (0, memoryview(b"")))
    if matrix.kind not in _CLASSES or matrix.complex or stored not in _STORED:
        raise ValueError(f"'{matrix.name}' is not an array of real numbers")
    values = np.frombuffer(data, order + _STORED[stored])
    if len(values) != math.prod(matrix.shape):
        raise ValueError(f"'{matrix.name}' of shape {matrix.shape} has {how_many(len(values), 'number')}")
    return values.astype(_CLASSES[matrix.kind]).reshape(matrix.shape, order="F")


def _cells(matrix: _Matrix, order: str) -> np.ndarray:
    cells = [
        _numbers(_matrix(data, order), order) if data else np.zeros((0, 0))
        for _, data in _elements(matrix.rest, order)
    ]
    if len(cells) != math.prod(matrix.shape):
        raise ValueError(f"'{matrix.name}' of shape {matrix.shape} has {how_many(len(cells), 'cell')}")
    found = np.empty(len(cells), dtype=object)
    found[:] = cells
    return found.reshape(matrix.shape, order="F")
