"""What a network has answered to the frames of a take so far, in one .npz file from which a lift goes on."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.files.arrays import load_all
from ...pipeline.files.atomic import whole_file


@dataclass(frozen=True, eq=False)
class Answers:
    """points (T, N, 3) and confidence (T, J) float32, NaN where there is no answer; sure (T,) float32 that there is a
    person, NaN where nothing was asked. looked: the first so many rows were looked at. source: what the answers rest
    on; another lift may only go on from them when its own is the same."""

    points: np.ndarray
    confidence: np.ndarray
    sure: np.ndarray
    looked: int
    source: str

    @staticmethod
    def none(rows: int, points: int, joints: int, source: str) -> Answers:
        """Of that many rows, before anything was looked at."""

        def nothing(*shape: int) -> np.ndarray:
            return np.full(shape, np.nan, np.float32)

        return Answers(nothing(rows, points, 3), nothing(rows, joints), nothing(rows), 0, source)

    def save(self, path: Path) -> None:
        """Write them as plain arrays; all of the file or none."""
        with whole_file(path) as partial:
            np.savez(partial, **{field.name: getattr(self, field.name) for field in fields(self)})


def load_answers(path: Path) -> Answers:
    """What `save` wrote; InputError for anything else."""
    try:
        held = load_all(path, *(field.name for field in fields(Answers)))
        points, confidence, sure = (held[name] for name in ("points", "confidence", "sure"))
        if (points.ndim, confidence.ndim, sure.ndim) != (3, 2, 1) or points.shape[2] != 3:
            raise ValueError("its arrays have other dimensions")
        if {array.dtype.kind for array in (points, confidence, sure)} != {"f"}:
            raise ValueError("its arrays hold other things than numbers")
        if not len(points) == len(confidence) == len(sure):
            raise ValueError("its arrays do not belong together")
        return Answers(points, confidence, sure, int(held["looked"]), str(held["source"]))
    except (ValueError, TypeError) as error:
        raise InputError(
            "file-damaged", f"Expected the answers of an interrupted lift at {path}: {error}; delete it."
        ) from None
