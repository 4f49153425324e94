"""Lifted takes with truth as a file, which `pcnet3d lab testbed` writes (models/lab/evaluation/testbed.py)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.files.arrays import load_all


def read_testbed(path: Path, *names: str) -> dict[str, np.ndarray]:
    """`take_start` (C + 1,), where each take's frames begin and the last one's end, and these of the file's arrays:
    lifted, truth (N, 17, 3), R_camera_from_body (N, 3, 3), lying, spread (N,), clip (C,). InputError for other files.
    """
    try:
        arrays = load_all(path, "take_start", *names)
    except InputError as error:
        raise InputError(error.code, f"Expected a file of pcnet3d lab testbed: {error}") from None
    start = arrays["take_start"]
    goes_up = start.ndim == 1 and start.dtype.kind in "iu" and len(start) > 1 and (np.diff(start) > 0).all()
    if not goes_up or start[0] != 0:
        raise InputError(
            "wrong-content",
            f"Expected a file of pcnet3d lab testbed at {path}, but its take_start does not go up from 0.",
        )
    takes, frames = len(start) - 1, int(start[-1])
    shapes = {
        "lifted": (frames, 17, 3), "truth": (frames, 17, 3), "R_camera_from_body": (frames, 3, 3),
        "lying": (frames,), "spread": (frames,), "clip": (takes,),
    }  # fmt: skip
    for name in names:
        array, kinds = arrays[name], "U" if name == "clip" else "fiub"
        if array.shape != shapes[name] or array.dtype.kind not in kinds:
            raise InputError(
                "wrong-content",
                f"Expected a file of pcnet3d lab testbed at {path}, with {name} of shape {shapes[name]}, got "
                f"{array.shape} of type {array.dtype}.",
            )
    return arrays
