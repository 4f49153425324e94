"""How many threads may compute at a time."""

from __future__ import annotations

import os

from .system import cores_given


def cores() -> int:
    """The cores that were given to this process; no more than OMP_NUM_THREADS says, where it is set: a batch runs one
    process for each core, with one thread. onnxruntime, FFmpeg and pools of threads are given this number by who opens
    them; BLAS and Arrow read the same variable themselves."""
    most = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores_given(), max(int(most), 1)) if most.isdecimal() else cores_given()


def limit_opencv() -> None:
    """OpenCV, which reads a variable of its own when it is imported, computes with as many threads as everything else.
    Of a whole program: a caller of single functions decides by `cv2.setNumThreads`."""
    os.environ.setdefault("OPENCV_FOR_THREADS_NUM", str(cores()))
