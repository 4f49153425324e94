"""Arrays out of strangers' .mat files of MATLAB 5 to 7; those of 7.3 are HDF5 and are refused with the way out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.errors import InputError
from ._numpy import Shape, fits, in_words

_BEGINS = b"MATLAB 5.0 MAT-file"
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n")


def keys(path: Path) -> frozenset[str]:
    """The names of the arrays; none for any other file. Never raises."""
    from scipy.io import whosmat

    try:
        if not path.is_file() or not _start(path).startswith(_BEGINS):
            return frozenset()
        return frozenset(name for name, *_ in whosmat(path))
    except Exception:  # scipy's parser raises whatever damaged bytes lead it to
        return frozenset()


def load(path: Path, *names: str, what: str) -> dict[str, np.ndarray]:
    """The arrays of these names, those that are there. InputError, saying that a .mat file of `what` was expected."""
    from scipy.io import loadmat

    try:
        start = _start(path)
        if start.startswith(_HDF5):
            raise InputError(
                f"{path} is a file of MATLAB 7.3 (HDF5); save it with save(..., '-v7') in MATLAB or Octave."
            )
        if not start.startswith(_BEGINS):
            raise InputError(f"Expected a .mat file of {what} at {path}, got something else.")
        return {key: value for key, value in loadmat(path, variable_names=names).items() if key in names}
    except InputError:
        raise
    except Exception as error:  # scipy's parser raises whatever damaged bytes lead it to
        raise InputError(f"{path} is damaged or was cut short ({error}); copy it again.") from None


def numbers(where: str, array: np.ndarray, *shapes: Shape) -> np.ndarray:
    """The array as float64; InputError unless it is one of numbers of one of these shapes."""
    if array.dtype.kind not in "fiu" or not any(fits(array.shape, shape) for shape in shapes):
        raise InputError(
            f"{where} of shape {' or '.join(map(in_words, shapes))}, got {array.shape} of {array.dtype}."
        )
    return array.astype(np.float64)


def _start(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(32)
