"""Pickles of arrays and plain containers, read without ever calling what they name.

A pickle is a program that may import and call anything. Here every name but those below is refused, and these are
stand-ins that only keep what they are given: arrays are then made from the bytes by numpy.frombuffer. joblib's files
are pickles too, compressed by zlib or not, with the arrays' bytes between the instructions
(joblib/numpy_pickle.py, NumpyArrayWrapper). numpy's own arrays of Python objects are pickles inside .npy and .npz.
"""

from __future__ import annotations

import pickle
import zlib
from io import BytesIO
from pathlib import Path
from typing import IO, Any, ClassVar

import numpy as np

from ..pipeline.errors import InputError

_ZLIB = b"\x78"
_PEEK_BYTES = 1 << 16
_LARGEST = 1 << 32  # bytes of a file once unpacked
_NUMBERS = "biufSU"


class _Dtype:
    def __init__(self, text: str, *_: Any) -> None:
        self.text, self.order = text, "="

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.order = state[1]

    @property
    def numpy(self) -> np.dtype:
        dtype = np.dtype(f"{self.order}{self.text}")
        if dtype.kind not in _NUMBERS:
            raise InputError(f"expected arrays of numbers, got one of {dtype}.")
        return dtype


class _Array:
    """What numpy's own pickles make: `_reconstruct`, then a state of version, shape, dtype, order and bytes."""

    def __init__(self, *_: Any) -> None:
        self.state: Any = None

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.state = state

    @property
    def numpy(self) -> Any:
        """The array; one of Python objects as nested lists, which are still to be resolved."""
        _, shape, dtype, fortran, raw = self.state
        if dtype.text.startswith("O"):
            return _nested(list(raw), shape)
        return np.frombuffer(_bytes(raw), dtype.numpy).reshape(shape, order="F" if fortran else "C")


def _nested(values: list[Any], shape: tuple[int, ...]) -> Any:
    """Objects of an array of this shape, by rows, as lists in lists; the only one where the shape is ()."""
    if len(values) != int(np.prod(shape, dtype=object)):
        raise InputError(f"expected an array of shape {shape}, got {len(values)} objects.")
    if len(shape) < 2:
        return values if shape else values[0]
    step = len(values) // max(shape[0], 1)
    return [_nested(values[i * step : (i + 1) * step], shape[1:]) for i in range(shape[0])]


def _bytes(raw: Any) -> Any:
    return raw.encode("latin1") if isinstance(raw, str) else raw  # Python 2 wrote bytes as text


class _Buffer:
    """What numpy's pickles of protocol 5 make: `_frombuffer` of bytes, dtype, shape and order."""

    def __init__(self, raw: Any, dtype: _Dtype, shape: tuple[int, ...], order: str, *_: Any) -> None:
        self.raw, self.dtype, self.shape, self.order = raw, dtype, shape, order

    @property
    def numpy(self) -> np.ndarray:
        if self.order not in ("C", "F"):
            raise InputError(f"expected arrays stored by rows or columns, got order {self.order!r}.")
        return np.frombuffer(self.raw, self.dtype.numpy).reshape(self.shape, order=self.order)  # type: ignore[arg-type]


class _Scalar:
    def __init__(self, dtype: _Dtype, raw: bytes) -> None:
        self.dtype, self.raw = dtype, raw

    @property
    def numpy(self) -> Any:
        return np.frombuffer(_bytes(self.raw), self.dtype.numpy)[0]


class _Wrapped:
    """joblib's: shape, order and dtype as attributes; the bytes follow in the file."""

    raw = b""

    @property
    def numpy(self) -> np.ndarray:
        said: dict[str, Any] = vars(self)
        array = np.frombuffer(self.raw, said["dtype"].numpy)
        return array.reshape(said["shape"], order="F" if said["order"] == "F" else "C")


def _encoded(text: str, _: str) -> bytes:
    return text.encode("latin1")


_NAMES = {
    ("numpy", "ndarray"): _Array,
    ("numpy", "dtype"): _Dtype,
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _Array for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _Scalar for core in ("core", "_core")},
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _Wrapped,
    **{(f"numpy.{core}.numeric", "_frombuffer"): _Buffer for core in ("core", "_core")},
    ("_codecs", "encode"): _encoded,  # how old protocols write bytes
    ("collections", "OrderedDict"): dict,
}


class _Reader(pickle._Unpickler):  # in Python, where the instruction that joblib extends can be replaced
    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)  # type: ignore[attr-defined]

    def __init__(self, stream: IO[bytes]) -> None:
        super().__init__(stream, encoding="latin1")  # the text of Python 2
        self.stream = stream

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) not in _NAMES:
            raise InputError(
                f"expected arrays and plain containers, got a pickle that asks for {module}.{name}; that could run a "
                "stranger's code and is refused."
            )
        return _NAMES[module, name]

    def load_build(self) -> None:
        super().load_build()  # type: ignore[misc]
        made = self.stack[-1]  # type: ignore[attr-defined]
        if isinstance(made, _Wrapped):
            said = vars(made)
            if said.get("numpy_array_alignment_bytes") is not None:
                self.stream.read(self.stream.read(1)[0])
            count = int(np.prod([int(n) for n in said["shape"]], dtype=object))
            made.raw = self.stream.read(count * said["dtype"].numpy.itemsize)

    dispatch[pickle.BUILD[0]] = load_build


def beginning(path: Path) -> bytes:
    """The first 64 KB of a pickle, unpacked; empty for what cannot be read. Never raises."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            start = file.read(_PEEK_BYTES)
        unpacked = zlib.decompressobj().decompress(start, _PEEK_BYTES) if start[:1] == _ZLIB else start
    except (OSError, zlib.error):
        return b""
    return unpacked if unpacked[:1] == pickle.PROTO else b""


def load(path: Path) -> Any:
    """What a pickle holds: dicts, lists, tuples, texts, numbers and arrays. InputError for anything else."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"Cannot read {path}: {error.strerror or error}.") from None
    return loads(content, str(path))


def loads(content: bytes, where: str) -> Any:
    """The same of a pickle's bytes, zlib's or not."""
    try:
        if content[:1] == _ZLIB:
            unpacking = zlib.decompressobj()
            content = unpacking.decompress(content, _LARGEST)
            if not unpacking.eof:
                raise InputError(
                    f"{where} was cut short or unpacks to more than 4 GiB; write or copy it again."
                )
        return _resolved(_Reader(BytesIO(content)).load())
    except InputError as error:
        raise error if where in str(error) else InputError(f"{where}: {error}") from None
    except Exception as error:  # the parser raises whatever damaged bytes lead it to
        raise InputError(
            f"{where} is no pickle, is damaged or was cut short ({error!r}); write it again."
        ) from None


def _resolved(value: Any) -> Any:
    if isinstance(value, _Array):
        held = value.numpy
        return held if isinstance(held, np.ndarray) else _resolved(held)
    if isinstance(value, (_Buffer, _Scalar, _Wrapped)):
        return value.numpy
    if isinstance(value, dict):
        return {_resolved(key): _resolved(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(map(_resolved, value))
    return value
