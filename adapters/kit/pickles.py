"""Pickles of arrays and plain containers, read without ever calling what they name.

A pickle is a program that may import and call anything. Here every name but those below is refused, and these are
stand-ins that only keep what they are given: arrays are then made from the bytes by numpy.frombuffer. joblib's files
are pickles too, compressed by zlib or not, with the arrays' bytes between the instructions
(joblib/numpy_pickle.py, NumpyArrayWrapper). numpy's own arrays of Python objects are pickles inside .npy and .npz.
"""

from __future__ import annotations

import pickle
import struct
import zlib
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...pipeline.core.errors import InputError, naming, readable
from ...pipeline.core.messages import how_many
from ...pipeline.files.unpacked import unpacked
from .opened import first_bytes

_ZLIB = b"\x78"
_PEEK_BYTES = 1 << 16
_NUMBERS = "biufSU"


class _Dtype:
    """What `numpy.dtype` makes; the order of its bytes comes in a state after it."""

    def __init__(self, text: str, *_: Any) -> None:
        self.text, self.order = text, "="

    @property
    def numpy(self) -> np.dtype:
        dtype = np.dtype(f"{self.order}{self.text}")
        if dtype.kind not in _NUMBERS:
            raise InputError("wrong-content", f"expected arrays of numbers, got one of {dtype}.")
        return dtype


class _Array:
    """What `_reconstruct` makes; shape, dtype, order and bytes come in a state after it, and maybe after a reference to
    it."""

    state: tuple[Any, ...] = ()

    def __init__(self, *_: Any) -> None:
        """Whatever the arguments say of an empty array."""

    @property
    def content(self) -> Any:
        """The array; one of Python objects as nested lists, which are still to be resolved."""
        _, shape, dtype, fortran, raw = self.state
        if dtype.text.startswith("O"):
            return _nested(list(raw), shape)
        return _from_buffer(_bytes(raw), dtype, shape, "F" if fortran else "C")


class _Wrapped:
    """joblib's: shape, order and dtype come in a state after it, and behind that the bytes."""


def _nested(values: list[Any], shape: tuple[int, ...]) -> Any:
    """Objects of an array of this shape, by rows, as lists in lists; the only one where the shape is ()."""
    if len(values) != int(np.prod(shape, dtype=object)):
        raise InputError(
            "wrong-content", f"expected an array of shape {shape}, got {how_many(len(values), 'object')}."
        )
    if len(shape) < 2 or not values:
        return values if shape else values[0]
    step = len(values) // max(shape[0], 1)
    return [_nested(values[i * step : (i + 1) * step], shape[1:]) for i in range(shape[0])]


def _bytes(raw: Any) -> Any:
    return raw.encode("latin1") if isinstance(raw, str) else raw  # Python 2 wrote bytes as text


def _from_buffer(raw: Any, dtype: _Dtype, shape: tuple[int, ...], order: str, *_: Any) -> np.ndarray:
    """numpy's `_frombuffer`, (...,), of pickles of protocol 5."""
    if order not in ("C", "F"):
        raise InputError("wrong-content", f"expected arrays stored by rows or columns, got order {order!r}.")
    return np.frombuffer(raw, dtype.numpy).reshape(shape, order=order)


def _scalar(dtype: _Dtype, raw: bytes) -> Any:
    return np.frombuffer(_bytes(raw), dtype.numpy)[0]


_NAMES = {
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): _Dtype,
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _Array for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _Wrapped,
    **{(f"numpy.{core}.numeric", "_frombuffer"): _from_buffer for core in ("core", "_core")},
    ("_codecs", "encode"): lambda text, _: text.encode("latin1"),  # how old protocols write bytes
    ("collections", "OrderedDict"): dict,
    ("collections", "defaultdict"): lambda *_: {},
    **{(module, "dict"): dict for module in ("builtins", "__builtin__")},  # what defaultdict would make
}


class _Reader(pickle._Unpickler):  # in Python, where the instruction that joblib extends can be replaced
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)

    def __init__(self, content: bytes) -> None:
        self.stream = BytesIO(content)
        self.size = len(content)
        super().__init__(self.stream, encoding="latin1")  # the text of Python 2

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _NAMES:
            raise InputError(
                "unsafe",
                f"expected arrays and plain containers, got a pickle that asks for {module}.{name}; that could run a "
                "stranger's code and is refused.",
            )
        return _NAMES[module, name]

    def get_extension(self, code: int) -> None:
        raise InputError(
            "unsafe", f"expected arrays and plain containers, got a pickle that asks for extension {code}."
        )

    def load_build(self) -> None:
        state = self.stack.pop()  # type: ignore[attr-defined]
        made = self.stack[-1]  # type: ignore[attr-defined]
        if isinstance(made, _Array) and isinstance(state, tuple):
            made.state = state
        elif isinstance(made, _Dtype) and isinstance(state, tuple):
            made.order = state[1]
        elif isinstance(made, _Wrapped) and isinstance(state, dict):
            self.stack[-1] = self._following(state)  # type: ignore[attr-defined]
        else:  # a state could change our own classes and functions
            raise InputError(
                "unsafe", f"expected arrays and plain containers, got a pickle that changes {made!r:.60}."
            )

    def _following(self, state: dict[str, Any]) -> np.ndarray:
        """The array (...,) whose bytes come next in the file."""
        if state.get("numpy_array_alignment_bytes") is not None:
            self.stream.read(self.stream.read(1)[0])
        count = int(np.prod([int(n) for n in state["shape"]], dtype=object))
        raw = self.stream.read(count * state["dtype"].numpy.itemsize)
        return _from_buffer(raw, state["dtype"], state["shape"], "F" if state["order"] == "F" else "C")

    dispatch[pickle.BUILD[0]] = load_build

    def load_bytearray8(self) -> None:
        """Python's own takes the memory before it reads."""
        (size,) = struct.unpack("<Q", self.read(8))  # type: ignore[attr-defined]
        if size > self.size:
            raise EOFError("it was cut short")
        self.append(bytearray(self.read(size)))  # type: ignore[attr-defined]

    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray8


def _bounded(load: Callable[[_Reader], None]) -> Callable[[_Reader], None]:
    """The same instruction for integers of up to 64 bits: the hashes of larger ones can be made to collide."""

    def bounded(reader: _Reader) -> None:
        load(reader)
        if reader.stack[-1].bit_length() > 64:  # type: ignore[attr-defined]
            raise InputError("wrong-content", "expected numbers of up to 64 bits, got a larger one.")

    return bounded


for _code in (pickle.INT, pickle.LONG, pickle.LONG1, pickle.LONG4):
    _Reader.dispatch[_code[0]] = _bounded(_Reader.dispatch[_code[0]])


def beginning(path: Path) -> bytes:
    """The first 64 KB of a pickle, unpacked; empty for what cannot be read. Never raises."""
    start = first_bytes(path, _PEEK_BYTES)
    try:
        if start[:1] == _ZLIB:
            start = zlib.decompressobj().decompress(start, _PEEK_BYTES)
    except zlib.error:
        return b""
    return start if start[:1] == pickle.PROTO else b""


def load(path: Path) -> Any:
    """What a pickle holds: dicts, lists, tuples, texts, numbers and arrays. InputError for anything else."""
    with readable(path, "a pickle"):
        content = path.read_bytes()
    return loads(content, str(path))


def loads(content: bytes, where: str) -> Any:
    """The same of a pickle's bytes, zlib's or not. where: the file, for InputError as of `load`."""
    try:
        with naming(where):
            content = unpacked(content, "a pickle") if content[:1] == _ZLIB else content
            return _resolved(_Reader(content).load(), {})
    except InputError:
        raise
    except Exception as error:  # the parser raises whatever damaged bytes lead it to
        raise InputError(
            "file-damaged",
            f"{where} is not a pickle, is damaged or was cut short ({error!r}); write it again.",
        ) from None


def _resolved(value: Any, done: dict[int, tuple[Any, Any]]) -> Any:
    """The value with arrays in place of stand-ins. done: values and what was made of them by id, so that what a pickle
    names twice is made once; a short one could otherwise name itself out of all memory."""
    if id(value) not in done:
        done[id(value)] = value, _made(value, done)
    return done[id(value)][1]


def _made(value: Any, done: dict[int, tuple[Any, Any]]) -> Any:
    if isinstance(value, _Array):
        held = value.content
        return held if isinstance(held, np.ndarray) else _resolved(held, done)
    if isinstance(value, dict):
        return {_resolved(key, done): _resolved(entry, done) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(_resolved(entry, done) for entry in value)
    if value is None or isinstance(value, (bool, int, float, str, bytes, np.ndarray, np.generic)):
        return value
    raise InputError("wrong-content", f"expected arrays and plain containers, got a {type(value).__name__}.")
