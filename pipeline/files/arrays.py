"""Arrays out of strangers' .npy and .npz files: never unpickled, and checked before memory is taken for them; and into
files of our own."""

from __future__ import annotations

import lzma
import math
import struct
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import combinations
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..core.errors import InputError
from .atomic import whole_file
from .opened import check_size

Shape = tuple[int | str, ...]  # a free axis has a name instead of a length
Stored = tuple[tuple[int, ...], bool, np.dtype, IO[bytes], int]

_PEEK_BYTES = 1 << 22
_BEGINNING = 1 << 16
_NPY, _ZIP = b"\x93NUMPY", b"PK"
# What the parsers of zip archives and npy headers raise on damaged bytes.
DAMAGE = (
    ValueError, EOFError, LookupError, RuntimeError, MemoryError, SyntaxError, TypeError, OverflowError,
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, tokenize.TokenError,
)  # fmt: skip


def keys(path: Path) -> tuple[str, ...]:
    """Names of the arrays in an .npz archive; () for an .npy file, whose one array has no name."""
    with damage_reported(path):
        if not _is_archive(path):
            return ()
        with zipfile.ZipFile(path) as archive:
            return tuple(name.removesuffix(".npy") for name in archive.namelist() if name.endswith(".npy"))


def arrays_in(path: Path) -> set[str]:
    """The names of the arrays in an .npz; none for any other file. Never raises."""
    try:
        return set(keys(path))
    except InputError:
        return set()


def load(path: Path, *shapes: Shape, key: str | None = None, limit: int | None = None) -> np.ndarray:
    """The array of an .npy file, or the one named `key` of an .npz archive, in its own numeric dtype; (...,).

    shapes: the shapes to accept, such as ("frames", 17, 3); none to accept any.
    limit: bytes of data to read at most, so that the array is cut to its first rows; one in Fortran order, whose rows
    are spread over the file, is read whole.
    Raises InputError for a file that is empty, cut short, longer than its header says or no numpy file, for
    a missing key, for Python objects (which would have to be unpickled), for anything but numbers, and for
    another shape. The header is compared with the file's size before anything is allocated.
    """
    array = _read(path, key, "fiu", shapes, limit)
    if not array.size:
        raise InputError(
            "nothing-usable",
            f"{path}: expected frames, got an array of shape {array.shape}, which holds none.",
        )
    return array


def load_all(path: Path, *needed: str) -> dict[str, np.ndarray]:
    """The arrays of an .npz archive by name, (...,): numbers, truth values and texts; with `needed`, only these.

    Raises InputError as `load` does, and for an archive without one of the needed.
    """
    with damage_reported(path):
        held = keys(path)
        names = needed or held
        if missing := [name for name in names if name not in held]:
            raise InputError(
                "wrong-content",
                f"Expected an .npz file with the arrays {', '.join(needed)} at {path}; "
                f"{', '.join(missing)} is missing.",
            )
        _check_archive(path, names)
    return {name: _read(path, name, "fiubU") for name in names}


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


def write_arrays(path: Path, **arrays: Any) -> None:
    """Arrays (...,) by name as a whole .npz file, compressed, whatever its name ends with."""
    # As np.savez_compressed, whose higher level takes twice as long and makes these files by 2 in 1000 smaller.
    with (
        whole_file(path) as partial,
        zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
    ):
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as part:
                np.lib.format.write_array(part, np.asanyarray(values), allow_pickle=False)


def _read(
    path: Path, key: str | None, kinds: str, shapes: Sequence[Shape] = (), limit: int | None = None
) -> np.ndarray:
    """As `load`, of dtypes of these kinds."""
    where = f"{path}" if key is None else f"{path}, array '{key}'"
    with opened(path, key) as (shape, fortran_order, dtype, stream, held):
        if dtype.kind not in kinds:
            objects = "Python objects, which could run a stranger's code when unpickled"
            raise InputError(
                "unsafe" if dtype.hasobject else "wrong-content",
                f"{where}: expected an array of numbers, got {objects if dtype.hasobject else dtype}; save it as a "
                "plain float array.",
            )
        if shapes and not any(fits(shape, wanted) for wanted in shapes):
            raise InputError(
                "wrong-content",
                f"{where}: expected an array of shape {' or '.join(map(in_words, shapes))}, got {shape}; "
                "check that this is the right file and adapter.",
            )
        promised = math.prod(shape) * dtype.itemsize
        if promised != held or min(shape, default=0) < 0:
            raise InputError(
                "file-damaged",
                f"{where}: its header promises {promised} bytes of data for shape {shape}, the file holds {held}; "
                "it was cut short or is damaged, so write or copy it again.",
            )
        if not promised:
            return np.zeros(shape, dtype)
        wanted = -1  # to the end, where an archive's checksum is compared
        if limit is not None and not fortran_order:
            shape = _beginning(shape, limit // dtype.itemsize)
            wanted = math.prod(shape) * dtype.itemsize
        array = np.frombuffer(stream.read(wanted), dtype)
        if dtype.kind == "U" and array.view(dtype.str[0] + "u4").max(initial=0) > sys.maxunicode:
            raise InputError(
                "file-damaged",
                f"{where}: its texts contain bytes that are not characters; the file is damaged, copy it again.",
            )
        return array.reshape(shape, order="F" if fortran_order else "C")


def _beginning(shape: tuple[int, ...], count: int) -> tuple[int, ...]:
    """The shape of the first rows, or of the first part of the first row, that hold at most `count` numbers."""
    cut = list(shape)
    for axis, length in enumerate(shape):
        cut[axis] = min(length, max(1, count // math.prod(shape[axis + 1 :])))
        if cut[axis] > 1:
            break
    return tuple(cut)


def fits(shape: tuple[int, ...], wanted: Shape) -> bool:
    """Whether a shape is the wanted one, whose free axes have names."""
    return len(shape) == len(wanted) and all(
        isinstance(want, str) or want == got for want, got in zip(wanted, shape, strict=True)
    )


def in_words(wanted: Shape) -> str:
    """The shape for an error message, such as (frames, 17, 3)."""
    return f"({', '.join(map(str, wanted))}{',' * (len(wanted) == 1)})"


def _is_archive(path: Path) -> bool:
    """Whether a file is a zip archive rather than an .npy file; InputError when it is neither."""
    if not path.is_file():
        raise InputError(
            "cannot-open",
            f"Expected a numpy file at {path}, found {'a folder' if path.is_dir() else 'no file'}.",
        )
    with path.open("rb") as file:
        start = file.read(len(_NPY))
    if not start:
        raise InputError(
            "file-damaged", f"{path} is empty (0 bytes); the program that wrote it did not finish."
        )
    if start != _NPY and not start.startswith(_ZIP):
        raise InputError(
            "format-unknown", f"{path} is neither an .npy nor an .npz file; pickles are never read."
        )
    return start != _NPY


def _check_archive(path: Path, names: Iterable[str]) -> None:
    """InputError when arrays of an archive are a bomb, many times as large as the file."""
    with zipfile.ZipFile(path) as archive:
        size = sum(archive.getinfo(f"{name}.npy").file_size for name in names)
    check_size(size, path.stat().st_size, "an archive")


@contextmanager
def opened(path: Path, key: str | None) -> Iterator[Stored]:
    """Of one array of a file what its header says, shape, whether the first index runs fastest, and type; and the bytes
    behind it, with how many there are. InputError when it is not there, not single, or damaged, also while the block
    runs."""
    with damage_reported(path):
        archived = _is_archive(path)
        held: tuple[str | None, ...] = keys(path) if archived else (None,)
        if key not in held:
            wanted = "a single array (.npy)" if key is None else f"an array '{key}'"
            listed = ", ".join(map(str, held)) or "no numpy arrays" if archived else "one without a name"
            raise InputError("wrong-content", f"Expected {wanted} in {path}; it holds {listed}.")
        if key is not None:
            _check_archive(path, (key,))
            with zipfile.ZipFile(path) as archive, archive.open(f"{key}.npy") as stream:
                yield _stored(stream, archive.getinfo(f"{key}.npy").file_size)
        else:
            with path.open("rb") as stream:
                yield _stored(stream, path.stat().st_size)


def _stored(stream: IO[bytes], size: int) -> Stored:
    form = np.lib.format
    first = form.read_magic(stream) == (1, 0)
    header = (form.read_array_header_1_0 if first else form.read_array_header_2_0)(stream)
    return *header, stream, size - stream.tell()


@contextmanager
def damage_reported(path: Path) -> Iterator[None]:
    """What parsers of damaged bytes raise, as an InputError."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError("cannot-open", f"Cannot read {path}: {error.strerror or error}.") from None
    except DAMAGE as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            "file-damaged", f"{path} is damaged or was cut short ({reason}); write or copy it again."
        ) from None
