"""Arrays out of strangers' .mat files: MATLAB 5 to 7 (_mat5.py), and 7.3, which is HDF5, by h5py (extra "hdf5")."""

from __future__ import annotations

from mmap import ACCESS_READ, mmap
from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError, naming
from ...pipeline.core.extras import needed_for
from ...pipeline.files.unpacked import check_size
from . import mat5 as _mat5

_BEGINS = b"MATLAB 5.0 MAT-file"
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n")


def keys(path: Path) -> frozenset[str]:
    """The names of the arrays; none for any other file. Never raises."""
    try:
        if not path.is_file():
            return frozenset()
        if _start(path).startswith(_HDF5):
            import h5py

            with h5py.File(path, "r") as file:
                return frozenset(file)
        if not _start(path).startswith(_BEGINS):
            return frozenset()
        with path.open("rb") as file:  # only the pages with the variables' names are read
            return _mat5.names(mmap(file.fileno(), 0, access=ACCESS_READ))
    except Exception:  # h5py raises whatever damaged bytes lead it to, or is missing
        return frozenset()


def load(path: Path, *names: str, what: str) -> dict[str, np.ndarray]:
    """The arrays (...,) of these names, those that are there. InputError, saying that a .mat file of `what` was
    expected."""
    try:
        with naming(path):
            start = _start(path)
            if start.startswith(_HDF5):
                return _load_hdf5(path, names)
            if not start.startswith(_BEGINS):
                raise InputError("format-unknown", f"Expected a .mat file of {what}, got something else.")
            return _mat5.arrays(path.read_bytes(), names)
    except InputError:
        raise
    except Exception as error:  # h5py raises whatever damaged bytes lead it to
        raise InputError(
            "file-damaged", f"{path} is damaged or was cut short ({error}); copy it again."
        ) from None


def _load_hdf5(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Axes are in reverse order there, and cells are references, which are not followed."""
    resave = "save(..., '-v7') in MATLAB or Octave"
    with needed_for(f"{path}, of MATLAB 7.3 (HDF5), has to be saved with {resave}, or", "hdf5"):
        import h5py
    found = {}
    with h5py.File(path, "r") as file:
        for name in names:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):  # others lead out of the file
                continue
            array = file[name]
            if not isinstance(array, h5py.Dataset) or array.dtype.kind not in "fiu":
                raise InputError(
                    "wrong-content",
                    f"{path}: expected '{name}' as an array of numbers, got cells of MATLAB 7.3; "
                    f"save it with {resave}.",
                )
            if array.is_virtual or array.external:
                raise InputError(
                    "unsafe", f"{path}: expected '{name}' in the file itself, got a link to others."
                )
            check_size(array.nbytes, path.stat().st_size, f"an array '{name}'")
            found[name] = np.asarray(array[()]).T
    return found


def _start(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(32)
