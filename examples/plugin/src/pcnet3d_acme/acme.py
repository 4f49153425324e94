"""Acme's poses.csv: a row a frame, time_s, then x, y, z of 17 joints; camera axes with y up, millimetres.

An empty cell is a joint that was not seen. Scores and the rows' video frames are not in the file.
"""

from pathlib import Path

import numpy as np

from pcnet3d.pipeline import GL_CAMERA, H36M17, InputError, PoseSequence

name = "acme"
gives = "poses"
reads = "Acme's poses.csv: 17 joints in camera axes, millimetres, with times"

HEADER = ["time_s", *(f"{joint}_{axis}" for joint in H36M17.joints for axis in "xyz")]


def sniff(path: Path) -> bool:
    try:
        with path.open(encoding="utf-8") as file:
            return file.readline(4096).strip().split(",") == HEADER
    except (OSError, ValueError):
        return False


def read(path: Path) -> tuple[PoseSequence]:
    """The one person of the file. Raises InputError when it is not Acme's."""
    if not sniff(path):
        raise InputError("format-unknown", f"{path}: expected a line time_s,pelvis_x,...; export it again.")
    try:
        lines = path.read_text(encoding="utf-8").splitlines()[1:]
        cells = [[float(cell or "nan") for cell in line.split(",")] for line in lines]
        rows = np.array(cells).reshape(len(cells), len(HEADER))
    except ValueError as error:
        raise InputError("file-damaged", f"{path}: expected {len(HEADER)} numbers a row: {error}.") from None
    joints = rows[:, 1:].reshape(-1, len(H36M17), 3)
    frame = GL_CAMERA.with_(origin="camera", unit="mm")
    return (PoseSequence(joints, H36M17, frame, time_s=rows[:, 0]),)
