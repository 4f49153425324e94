"""Keypoints of any frame rate, and with holes, as rows that the network was trained on.

It saw 20 to 60 frames per second, most often 30, and hardly a joint that is missing for a frame or two. So rows that
are further apart get others between them. Rows that are nearer together are lifted as several takes, each of every
second row, or every third, ...: once at about 60 a second and once at about 30, and all answers are averaged. A joint
that is missing for a moment lies on a line from where it was seen to where it is seen again. docs/research.md, "Frame
rates and holes", has what each of these is worth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import on_lines
from .keypoints import USUAL_HZ

_FASTEST_HZ = 60.0
_LINE_S = 0.3  # a joint that is missing for longer is left to the network


@dataclass(frozen=True)
class Clock:
    """finer: rows of the network's clock to a row of the take. phases: as how many takes the rows are lifted, once for
    each. longest: rows of the clock that a line bridges."""

    finer: int
    phases: tuple[int, ...]
    longest: int

    def rows(self, pixels: np.ndarray, confidence: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Joints (T, J, 2) and confidence (T, J) of a take as rows of the clock, ((T - 1) * finer + 1, ...); a joint
        on a line has the lesser of the confidences at its ends."""
        count = (len(pixels) - 1) * self.finer + 1
        fine_pixels = np.full((count, *pixels.shape[1:]), np.nan)
        fine_confidence = np.full((count, pixels.shape[1]), np.nan)
        fine_pixels[:: self.finer], fine_confidence[:: self.finer] = pixels, confidence
        row, visible = np.arange(count), is_finite(fine_pixels)
        for joint in np.flatnonzero(visible.any(axis=0)):
            rows = np.flatnonzero(visible[:, joint])
            after = np.searchsorted(rows, row)
            before, behind = rows[np.maximum(after - 1, 0)], rows[np.minimum(after, len(rows) - 1)]
            gap = (before < row) & (row < behind) & (behind - before <= self.longest + 1)
            fine_pixels[gap, joint] = on_lines(fine_pixels[:, joint], row)[gap]
            ends = fine_confidence[before[gap], joint], fine_confidence[behind[gap], joint]
            fine_confidence[gap, joint] = np.minimum(*ends)
        return fine_pixels, fine_confidence


def averaged(answers: np.ndarray, phases: int) -> np.ndarray:
    """Answers (T, ...) of all phases, each row the mean over the phases about it; where there is but one, as they
    are."""
    if phases == 1:
        return answers
    # Every phase has the same weight, and the row is in the middle.
    weight = np.convolve(np.full(phases, 1 / phases), [0.5, 0.5] if phases % 2 == 0 else [1.0])
    half = len(weight) // 2
    padded = np.concatenate(
        [np.repeat(answers[:1], half, axis=0), answers, np.repeat(answers[-1:], half, axis=0)]
    )
    total = np.zeros_like(answers)
    for first, part in enumerate(weight):
        total += part * padded[first : first + len(answers)]
    return total


def clock_of(rate: float | None, rows: np.ndarray | None = None) -> Clock:
    """The clock of a take with so many rows a second, gaps counted; None where that is unknown, which counts as the
    usual one. rows: (T,) places of those that are there, where some may be missing."""
    rate = USUAL_HZ if rate is None else rate
    finer, phases = (
        max(round(USUAL_HZ / rate), 1),
        {max(round(rate / each), 1) for each in (_FASTEST_HZ, USUAL_HZ)},
    )
    step = 1 if rows is None or len(rows) < 2 else int(np.median(np.diff(rows)))
    return Clock(finer, tuple(sorted(phases)), max(round(_LINE_S * rate * finer), step * finer - 1))
