"""Pickles of arrays and plain containers, read without ever calling what they name.

A pickle is a program that may import and call anything. Here every name but those below is refused, and these are
functions of our own, which take no memory that the file does not fill. joblib's files are pickles too, compressed by
zlib or not, with the arrays' bytes between the instructions (joblib/numpy_pickle.py, NumpyArrayWrapper). numpy's own
arrays of Python objects are pickles inside .npy and .npz.
"""

from __future__ import annotations

import math
import pickle
import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...pipeline.core.errors import InputError, naming, readable
from ...pipeline.files.arrays import opened
from ...pipeline.files.opened import first_bytes, unpacked

_ZLIB = b"\x78"
_PEEK_BYTES = 1 << 16
_NUMBERS = "biufSU"


class _Named:
    """A class of numpy's or joblib's that is only named."""


def _array(*_: Any) -> np.ndarray:
    """`_reconstruct`: what is in the array comes in a state after it, and maybe after a reference to it."""
    return np.empty(0)


def _dtype(text: Any, *_: Any) -> np.dtype:
    """The order of its bytes comes in a state after it."""
    return np.dtype(str(text))


def _from_buffer(raw: Any, dtype: np.dtype, shape: tuple[int, ...], order: str, *_: Any) -> np.ndarray:
    """(...,), which nothing in the file can write into. Of bytes alone: of an array of objects the bytes are where in
    memory these are."""
    if not isinstance(raw, bytes | bytearray):
        raise ValueError("an array is made of something else than bytes")
    return np.frombuffer(bytes(raw), dtype).reshape(shape, order=order)  # type: ignore[call-overload]


_NAMES = {
    ("numpy", "ndarray"): _Named,
    ("numpy", "dtype"): _dtype,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _Named,
    ("_codecs", "encode"): lambda text, _: text.encode("latin1"),  # how old protocols write bytes
    ("collections", "OrderedDict"): dict,
    ("collections", "defaultdict"): lambda *_: {},
    ("builtins", "dict"): dict,  # what defaultdict would make
}
for _core in ("core", "_core"):
    _NAMES[f"numpy.{_core}.multiarray", "_reconstruct"] = _array
    _NAMES[f"numpy.{_core}.multiarray", "scalar"] = lambda dtype, raw: _from_buffer(raw, dtype, (-1,), "C")[0]
    _NAMES[f"numpy.{_core}.numeric", "_frombuffer"] = _from_buffer


class _Reader(pickle._Unpickler):  # in Python, where the instruction that joblib extends can be replaced
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)

    def __init__(self, content: bytes) -> None:
        self.stream = BytesIO(content)
        self.size = len(content)
        super().__init__(self.stream)

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _NAMES:
            raise InputError(
                "unsafe",
                f"expected arrays and plain containers, got a pickle that asks for {module}.{name}; that could run a "
                "stranger's code and is refused.",
            )
        return _NAMES[module, name]

    def get_extension(self, code: int) -> None:
        self.find_class("extension", str(code))

    def load_build(self) -> None:
        state = self.stack.pop()  # type: ignore[attr-defined]
        made = self.stack[-1]  # type: ignore[attr-defined]
        if isinstance(made, np.ndarray) and isinstance(state, tuple):
            _fill(made, *state[1:])
        elif isinstance(made, np.dtype) and isinstance(state, tuple) and state[1] in ("<", "|", "="):
            pass
        elif isinstance(made, _Named) and isinstance(state, dict):
            self.stack[-1] = self._following(state)  # type: ignore[attr-defined]
        else:  # a state could change our own classes and functions
            raise InputError(
                "unsafe", f"expected arrays and plain containers, got a pickle that changes {made!r:.60}."
            )

    def _following(self, state: dict[str, Any]) -> np.ndarray:
        """The array (...,) whose bytes come next in the file."""
        if state.get("numpy_array_alignment_bytes") is not None:
            self.stream.read(self.stream.read(1)[0])
        raw = self.stream.read(math.prod(map(int, state["shape"])) * state["dtype"].itemsize)
        return _from_buffer(raw, state["dtype"], state["shape"], "F" if state["order"] == "F" else "C")

    dispatch[pickle.BUILD[0]] = load_build

    def load_bytearray8(self) -> None:
        """Python's own takes the memory before it reads."""
        (size,) = struct.unpack("<Q", self.read(8))  # type: ignore[attr-defined]
        if size > self.size:
            raise EOFError("it was cut short")
        self.append(bytearray(self.read(size)))  # type: ignore[attr-defined]

    dispatch[pickle.BYTEARRAY8[0]] = load_bytearray8


def _fill(array: np.ndarray, shape: tuple[int, ...], dtype: np.dtype, fortran: bool, raw: Any) -> None:
    """Puts values into an array; numpy's own instruction does not look at what fits."""
    kept = isinstance(raw, list) if dtype.kind == "O" else isinstance(raw, bytes) and dtype.kind in _NUMBERS
    size = len(raw) if dtype.kind == "O" else len(raw) / max(dtype.itemsize, 1)
    if not kept or min(shape, default=0) < 0 or math.prod(shape) != size:
        raise ValueError(f"an array of shape {shape} of {dtype} has other values")
    array.__setstate__((1, shape, dtype, bool(fortran), raw))  # type: ignore[arg-type]
    array.flags.writeable = False


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
    start = first_bytes(path, _PEEK_BYTES, packed=_ZLIB)
    return start if start[:1] == pickle.PROTO else b""


def load(path: Path) -> Any:
    """What a pickle holds: dicts, lists, tuples, texts, numbers and arrays. InputError for anything else."""
    with readable(path, "a pickle"):
        content = path.read_bytes()
    return loads(content, str(path))


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


def loads(content: bytes, where: str) -> Any:
    """The same of a pickle's bytes, zlib's or not. where: the file, for InputError as of `load`."""
    try:
        with naming(where):
            content = unpacked(content, "a pickle") if content[:1] == _ZLIB else content
            return _plain(_Reader(content).load(), {})
    except InputError:
        raise
    except Exception as error:  # the parser raises whatever damaged bytes lead it to
        raise InputError(
            "file-damaged",
            f"{where} is not a pickle, is damaged or was cut short ({error!r}); write it again.",
        ) from None


def _plain(value: Any, done: dict[int, tuple[Any, Any]]) -> Any:
    """The value, arrays of objects as lists in lists. done: values and what was made of them by id, so that what a
    pickle names twice is made once; a short one could otherwise name itself out of all memory."""
    if id(value) in done:
        return done[id(value)][1]
    made = value
    if isinstance(value, np.ndarray) and value.dtype == object:
        made = _plain(value.tolist() if value.size else [], done)
    elif isinstance(value, dict):
        made = {_plain(key, done): _plain(entry, done) for key, entry in value.items()}
    elif isinstance(value, list | tuple):
        made = type(value)(_plain(entry, done) for entry in value)
    elif not isinstance(value, bool | int | float | str | bytes | np.ndarray | np.generic | None):
        raise InputError(
            "wrong-content", f"expected arrays and plain containers, got a {type(value).__name__}."
        )
    elif isinstance(value, np.ndarray | np.generic) and value.dtype.kind not in _NUMBERS:
        raise InputError("wrong-content", f"expected arrays of numbers, got one of {value.dtype}.")
    done[id(value)] = value, made
    return made
