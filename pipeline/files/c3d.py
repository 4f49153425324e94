"""The points and parameters of C3D files (formats.md section 6; "The C3D File Format User Guide", c3d.org).

ezc3d, which writes them for us, ends the whole program on some damaged files, so strangers' files are read here:
numbers of the header and of the parameters are compared with the file's length before they are used.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from ..core.messages import how_many

_BLOCK = 512
_INTEL, _OTHERS = 84, (85, 86)  # the processor whose numbers the file has; DEC and MIPS of the 1990s
_ITEM = {-1: 1, 1: 1, 2: 2, 4: 4}  # bytes by a parameter's type: text, byte, integer, real
LAST = 65535  # the greatest number of a frame that the header's two bytes hold


class C3d(NamedTuple):
    """points: (T, M, 3) float32 in the file's unit, NaN where the residual is negative. first: the number of the first
    frame, usually 1. rate_hz: of the points. parameters: values by "GROUP:NAME", texts or numbers in the file's
    order."""

    points: np.ndarray
    first: int
    rate_hz: float
    parameters: dict[str, list[Any]]


def parse(content: bytes) -> C3d:
    """ValueError, saying why, for anything but a whole C3D file."""
    if len(content) < _BLOCK or content[0] == 0:
        raise ValueError("it has no header")
    begin = (content[0] - 1) * _BLOCK
    processor = content[begin + 3] if begin + 3 < len(content) else 0
    if processor in _OTHERS:
        raise ValueError("its numbers are those of a DEC or MIPS machine; write it again for Intel's")
    if processor != _INTEL:
        raise ValueError("its parameters are not where its header says")
    parameters = _parameters(content, begin + 4)
    _, count, analog, first, last, _, _, _, block = map(int, np.frombuffer(content[:18], "<u2"))
    # What the header's two bytes cannot hold is told by parameters.
    starts, ends = (parameters.get(f"TRIAL:ACTUAL_{end}_FIELD", []) for end in ("START", "END"))
    if len(starts) == len(ends) == 2 and all(isinstance(value, int) for value in (*starts, *ends)):
        first, last = ((two[0] & 0xFFFF) + 65536 * (two[1] & 0xFFFF) for two in (starts, ends))
    width, frames = 4 * count + analog, last - first + 1
    scale, header_rate = (float(np.frombuffer(content[at : at + 4], "<f4")[0]) for at in (12, 20))
    item = 4 if scale < 0 else 2
    start, promised = (block - 1) * _BLOCK, frames * width * item
    if not count or not block or frames < 1 or len(content) < start + promised:
        raise ValueError(
            f"its header promises {how_many(frames, 'frame')} of {how_many(count, 'point')}, "
            f"{len(content)} bytes do not hold them"
        )
    if last == LAST and len(content) - start - promised >= max(_BLOCK, width * item):
        raise ValueError(
            f"its header counts to frame {LAST}, its maximum, and more data follow, so the file does not say how "
            "many frames it has; export it in parts, or as TRC"
        )
    data = content[start : start + promised]
    values = np.frombuffer(data, "<f4" if item == 4 else "<i2").astype(np.float32)
    points = values.reshape(frames, width)[:, : 4 * count].reshape(frames, count, 4)
    places = points[..., :3] if item == 4 else points[..., :3] * np.float32(scale)
    (rate_hz,) = parameters.get("POINT:RATE", [])[:1] or [header_rate]
    if isinstance(rate_hz, str):
        raise ValueError("its POINT:RATE is text, not a number")
    return C3d(np.where(points[..., 3:] < 0, np.nan, places), first, rate_hz, parameters)


def texts(parameters: dict[str, list[Any]], name: str) -> list[str]:
    """A parameter's texts with those of its continuations (LABELS, LABELS2, ...), which 255 at a time need."""
    joined: list[str] = []
    for key in (name, *(f"{name}{number}" for number in range(2, 300))):
        if key not in parameters:
            break
        joined += map(str, parameters[key])
    return joined


def _parameters(content: bytes, at: int) -> dict[str, list[Any]]:
    """Records one after the other, groups and parameters mixed, each with the distance to the next."""
    groups: dict[int, str] = {}
    records: list[tuple[int, str, list[Any]]] = []
    while at + 2 <= len(content):
        length, group = (int(number) for number in np.frombuffer(content[at : at + 2], np.int8))
        body = at + 2 + abs(length)
        if length == 0 or group == 0:
            break
        name = content[at + 2 : body].decode("latin1").strip().upper()
        distance = int.from_bytes(content[body : body + 2], "little") if body + 2 <= len(content) else 0
        at = body + distance if distance else len(content)
        if group < 0:
            groups[-group] = name
        else:
            records.append((group, name, _values(content[body + 2 : at])))
    return {f"{groups.get(group, '')}:{name}": values for group, name, values in records}


def _values(record: bytes) -> list[Any]:
    """Of a parameter's record: type, number of dimensions, dimensions, data, the first dimension running fastest."""
    kind = int.from_bytes(record[:1], signed=True)
    dims = list(record[2 : 2 + record[1]]) if len(record) > 1 else []
    count = math.prod(dims)
    data = record[2 + len(dims) :][: count * _ITEM.get(kind, 0)]
    if kind not in _ITEM or len(data) < count * _ITEM[kind]:
        raise ValueError("its parameters are damaged")
    if kind == -1:
        length = dims[0] if dims else 1
        pieces = [data[i : i + length] for i in range(0, len(data), length)] if length else []
        return [piece.decode("utf-8", "replace").strip("\0 ") for piece in pieces]
    if kind == 1:
        return list(data)
    return np.frombuffer(data, "<i2" if kind == 2 else "<f4").tolist()
