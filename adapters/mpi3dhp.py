"""MPI-INF-3DHP's `annot.mat` and `annot_data.mat`: joints in camera axes, millimetres (formats.md section 8.3).

annot.mat (training) has a cell a camera in `annot3`, (frames, 84): 28 joints, of which the data set's
mpii_get_joint_set.m names 17 as relevant. annot_data.mat (test) has `annot3` (3, 17, 1, frames) of those 17 and
`valid_frame`. A row is a frame of the video, from 0; the frame rate, 25 or 50, is not in the file. There is no nose:
the middle of the head stands in. Files of MATLAB 7.3 are HDF5 and are refused with the way out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.errors import InputError
from ..pipeline.frames import CAMERA
from ..pipeline.layouts import MPI3DHP17
from ..pipeline.pose import PoseSequence

name = "mpi3dhp"
gives = "poses"
reads = "MPI-INF-3DHP's annot.mat and annot_data.mat: camera axes, millimetres"

_KEY = "annot3"
_BEGINS = b"MATLAB 5.0 MAT-file"
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n")
_ALL = 28
_RELEVANT = (
    7,
    5,
    14,
    15,
    16,
    9,
    10,
    11,
    23,
    24,
    25,
    18,
    19,
    20,
    4,
    3,
    6,
)  # of the 28, in the order of the 17


def sniff(path: Path) -> bool:
    from scipy.io import whosmat

    try:
        return path.is_file() and _start(path).startswith(_BEGINS) and _KEY in {e[0] for e in whosmat(path)}
    except Exception:  # scipy's parser raises whatever damaged bytes lead it to
        return False


def read(path: Path, camera: int = 0) -> tuple[PoseSequence]:
    """The one person as a camera sees them: MPI3DHP17 in CAMERA, millimetres, from the camera's centre.

    camera: which of annot.mat's cameras, from 0. Frames that are marked as not valid are left out. InputError when the
    file is damaged, of MATLAB 7.3, or has no such camera.
    """
    held = _loaded(path)
    if _KEY not in held:
        raise InputError(f"Expected an array '{_KEY}' in {path}, as MPI-INF-3DHP has it.")
    stored = held[_KEY]
    if stored.dtype == object:
        cells = [np.asarray(cell) for cell in stored.ravel()]
        if not 0 <= camera < len(cells):
            raise InputError(f"{path} has the cameras 0 to {len(cells) - 1}; got camera={camera}.")
        joints = _numbers(path, cells[camera], (-1, _ALL * 3)).reshape(-1, _ALL, 3)[:, _RELEVANT]
    else:
        if camera:
            raise InputError(f"{path} has one camera, 0; got camera={camera}.")
        joints = _numbers(path, stored[..., None] if stored.ndim == 3 else stored, (3, len(MPI3DHP17), 1, -1))
        joints = np.transpose(joints[:, :, 0], (2, 1, 0))
    rows = np.arange(len(joints))
    valid = held.get("valid_frame")
    if valid is not None and valid.size == len(joints):
        rows = np.flatnonzero(np.asarray(valid).ravel())
    return (
        PoseSequence(
            joints=joints[rows],
            layout=MPI3DHP17,
            frame=CAMERA.with_(origin="camera", unit="mm"),
            frame_index=rows,
        ),
    )


def _start(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(32)


def _loaded(path: Path) -> dict[str, np.ndarray]:
    from scipy.io import loadmat

    try:
        start = _start(path)
        if start.startswith(_HDF5):
            raise InputError(
                f"{path} is a file of MATLAB 7.3 (HDF5); save it with save(..., '-v7') in MATLAB or Octave."
            )
        if not start.startswith(_BEGINS):
            raise InputError(f"Expected a .mat file of MPI-INF-3DHP at {path}, got something else.")
        return loadmat(path, variable_names=[_KEY, "valid_frame"])
    except InputError:
        raise
    except Exception as error:  # scipy's parser raises whatever damaged bytes lead it to
        raise InputError(f"{path} is damaged or was cut short ({error}); copy it again.") from None


def _numbers(path: Path, array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    fits = array.ndim == len(shape) and all(
        want in (-1, got) for want, got in zip(shape, array.shape, strict=True)
    )
    if not fits or array.dtype.kind not in "fiu":
        wanted = ", ".join("frames" if n == -1 else str(n) for n in shape)
        raise InputError(
            f"{path}: expected '{_KEY}' of shape ({wanted}), got {array.shape} of {array.dtype}."
        )
    return array.astype(np.float64)
