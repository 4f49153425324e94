"""Pickles of arrays and plain containers, read without ever calling what they name.

A pickle is a program that may import and call anything. Here every name but those below is refused, and these are
functions of our own, which take no memory that the file does not fill. joblib's files are pickles too, compressed by
zlib or not, with the arrays' bytes between the instructions (joblib/numpy_pickle.py, NumpyArrayWrapper). numpy's own
arrays of Python objects are pickles inside .npy and .npz.
"""

from __future__ import annotations

import math
import pickle
import re
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...pipeline.core.errors import InputError, naming, readable
from ...pipeline.files.arrays import opened
from ...pipeline.files.opened import check_size, first_bytes, unpacked

_ZLIB = b"\x78"
_PEEK_BYTES = 1 << 16
_TYPE = re.compile(r"[biufSUO]\d{1,10}")
_MOST_AXES = 32
_KEYS = (
    str | bytes | int | float | np.generic | None
)  # a tuple that names itself again and again is hashed for ever


class _Named:
    """A class of others that is only named."""


def _array(*_: Any) -> np.ndarray:
    """`_reconstruct`: what is in the array comes in a state after it, and maybe after a reference to it."""
    return np.empty(0)


def _dtype(text: Any, *_: Any) -> np.dtype:
    """The order of its bytes comes in a state after it. Other texts could make a type of millions of parts."""
    if not isinstance(text, str) or not _TYPE.fullmatch(text):
        kind = text if isinstance(text, str) else type(text).__name__
        raise InputError("wrong-content", f"expected arrays of numbers, got one of {kind:.60}.")
    return np.dtype(text)


def _from_buffer(raw: Any, dtype: Any, shape: Any, order: Any, *_: Any) -> np.ndarray:
    """(...,), which nothing in the file can write into."""
    _check(shape, dtype, raw)
    return np.frombuffer(raw, dtype).reshape(shape, order=order)


def _check(shape: Any, dtype: Any, held: Any) -> None:
    """ValueError unless these are the bytes, or the objects, of an array of that shape and type. numpy does not look:
    it would take the bytes for where in memory objects are, or write all of a shape that names itself into an error."""
    if isinstance(dtype, np.dtype):
        kind, size = (list, 1) if dtype.kind == "O" else (bytes, max(dtype.itemsize, 1))
        if type(held) is kind and _count(shape) * size == len(held):
            return
    raise ValueError("an array has other values than its shape and type say")


def _count(shape: Any) -> int:
    """Of the values of an array; ValueError for what is no shape. The product of many lengths takes for ever."""
    plain = type(shape) is tuple and len(shape) <= _MOST_AXES
    if not plain or not all(type(length) is int and length >= 0 for length in shape):
        raise ValueError("the shape of an array is none")
    return math.prod(shape)


_NAMES = {
    ("numpy", "ndarray"): _Named,
    ("numpy", "dtype"): _dtype,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _Named,
    ("_codecs", "encode"): lambda text, _: text.encode("latin1"),  # how old protocols write bytes
    ("collections", "OrderedDict"): lambda: {},
    ("collections", "defaultdict"): lambda *_: {},
    ("builtins", "dict"): _Named,  # what defaultdict would make
}
for _core in ("core", "_core"):
    _NAMES[f"numpy.{_core}.multiarray", "_reconstruct"] = _array
    _NAMES[f"numpy.{_core}.multiarray", "scalar"] = lambda dtype, raw: _from_buffer(raw, dtype, (), "C")[()]
    _NAMES[f"numpy.{_core}.numeric", "_frombuffer"] = _from_buffer


class _Reader(pickle._Unpickler):  # in Python, where the instruction that joblib extends can be replaced
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)

    def __init__(self, content: bytes) -> None:
        self.stream = BytesIO(content)
        self.size, self.made = len(content), 0  # bytes
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
        elif isinstance(made, np.dtype) and isinstance(state, tuple):
            if state[1] not in ("<", "|", "="):
                raise InputError(
                    "wrong-content",
                    "expected numbers whose lowest byte comes first, got others; save them as a plain float array.",
                )
        elif isinstance(made, _Named) and isinstance(state, dict):
            self.stack[-1] = self._following(state)  # type: ignore[attr-defined]
        else:  # a state could change our own classes and functions
            raise InputError(
                "unsafe",
                f"expected arrays and plain containers, got a pickle that changes a {type(made).__name__}.",
            )

    def _following(self, state: dict[str, Any]) -> np.ndarray:
        """The array (...,) whose bytes come next in the file."""
        if state.get("numpy_array_alignment_bytes") is not None:
            self.stream.read(self.stream.read(1)[0])
        raw = self.stream.read(_count(state["shape"]) * state["dtype"].itemsize)
        return _from_buffer(raw, state["dtype"], state["shape"], "F" if state["order"] == "F" else "C")

    dispatch[pickle.BUILD[0]] = load_build

    # Python's own takes the memory before it reads, and what can be changed cannot be shared.
    dispatch[pickle.BYTEARRAY8[0]] = pickle._Unpickler.load_binbytes8  # type: ignore[attr-defined]

    def load_setitem(self) -> None:
        value, key = self.stack.pop(), self.stack.pop()  # type: ignore[attr-defined]
        self._put([key, value])

    def load_setitems(self) -> None:
        self._put(self.pop_mark())  # type: ignore[attr-defined]

    def load_dict(self) -> None:
        items = self.pop_mark()  # type: ignore[attr-defined]
        self.append({})  # type: ignore[attr-defined]
        self._put(items)

    def _put(self, items: list[Any]) -> None:
        """Keys and values, by turns, into a dict and into nothing else: an array would make arrays of its keys."""
        made = self.stack[-1]  # type: ignore[attr-defined]
        if type(made) is not dict:
            raise InputError(
                "unsafe",
                f"expected arrays and plain containers, got a pickle that changes a {type(made).__name__}.",
            )
        for key, value in zip(items[::2], items[1::2], strict=True):
            if not isinstance(key, _KEYS):
                raise InputError(
                    "wrong-content", f"expected texts and numbers as keys, got a {type(key).__name__}."
                )
            made[key] = value

    dispatch[pickle.SETITEM[0]] = load_setitem
    dispatch[pickle.SETITEMS[0]] = load_setitems
    dispatch[pickle.DICT[0]] = load_dict

    def load_set(self) -> None:
        raise InputError("wrong-content", "expected arrays and plain containers, got a set.")

    dispatch[pickle.EMPTY_SET[0]] = dispatch[pickle.FROZENSET[0]] = load_set


def _fill(array: np.ndarray, shape: Any, dtype: Any, fortran: Any, raw: Any) -> None:
    """Puts values into an array that has none: of values put in before, numpy could free numbers as if they were
    objects."""
    _check(shape, dtype, raw)
    if not array.flags.writeable:
        raise ValueError("an array is given values twice")
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


def _counted(load: Callable[[_Reader], None]) -> Callable[[_Reader], None]:
    """The same instruction, with what it makes counted: a short pickle could have what is long copied again and
    again."""

    def counted(reader: _Reader) -> None:
        load(reader)
        reader.made += sys.getsizeof(reader.stack[-1])  # type: ignore[attr-defined]
        check_size(reader.made, reader.size, "a pickle")

    return counted


_MAKING = (pickle.REDUCE, pickle.BUILD, pickle.NEWOBJ, pickle.NEWOBJ_EX, pickle.OBJ, pickle.INST)
for _code in (*_MAKING, pickle.EMPTY_DICT, pickle.EMPTY_LIST):
    _Reader.dispatch[_code[0]] = _counted(_Reader.dispatch[_code[0]])


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
    done[id(value)] = value, made
    return made
