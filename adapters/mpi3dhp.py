"""MPI-INF-3DHP's `annot.mat` and `annot_data.mat`: joints in camera axes, millimetres (formats.md section 8.3).

annot.mat (training) has a cell a camera in `annot3`, (frames, 84): 28 joints, of which the data set's
mpii_get_joint_set.m names 17 as relevant. annot_data.mat (test) has `annot3` (3, 17, 1, frames) of those 17 and
`valid_frame`. A row is a frame of the video, from 0; the frame rate, 25 or 50, is not in the file. There is no nose:
the middle of the head stands in.

Test files are of MATLAB 7.3, which is HDF5 with the axes in reverse order; h5py (extra "hdf5") reads them. Cells are
references there, which are not followed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import MPI3DHP17
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.matlab import keys, load
from .kit.numpy import shaped

name = "mpi3dhp"
gives = "poses"
made_by = MadeBy("measured", "MPI-INF-3DHP's cameras")
reads = "MPI-INF-3DHP's annot.mat and annot_data.mat: camera axes, millimetres"

_KEY = "annot3"
_ALL = 28
# Of the 28, in the order of the 17
_RELEVANT = (7, 5, 14, 15, 16, 9, 10, 11, 23, 24, 25, 18, 19, 20, 4, 3, 6)


def sniff(path: Path) -> bool:
    return _KEY in keys(path)


def read(path: Path, camera: int = 0) -> tuple[PoseSequence]:
    """The one person as a camera sees them: MPI3DHP17 in CAMERA, millimetres, from the camera's centre.

    camera: which of annot.mat's cameras, from 0. Frames that are marked as not valid are left out. InputError when the
    file is damaged or has no such camera, and for MATLAB 7.3 without h5py or with cells.
    """
    held = load(path, _KEY, "valid_frame", what="MPI-INF-3DHP")
    if _KEY not in held:
        raise InputError("wrong-content", f"Expected an array '{_KEY}' in {path}, as MPI-INF-3DHP has it.")
    stored, where = held[_KEY], f"{path}, array '{_KEY}'"
    if stored.dtype == object:
        cells = [np.asarray(cell) for cell in stored.ravel()]
        if not 0 <= camera < len(cells):
            raise InputError(
                "bad-value", f"{path} has the cameras 0 to {len(cells) - 1}; got camera={camera}."
            )
        joints = shaped(cells[camera], where, ("frames", _ALL * 3)).reshape(-1, _ALL, 3)[:, _RELEVANT]
    else:
        if camera:
            raise InputError("bad-value", f"{path} has one camera, 0; got camera={camera}.")
        stored = stored[..., None] if stored.ndim == 3 else stored
        joints = shaped(stored, where, (3, len(MPI3DHP17), 1, "frames"))
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
