"""Ranks and means of the rows around each, as scipy.ndimage has them: to import that takes longer than all of them in a
take of some minutes."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..core.blocks import blocks


def ranked(x: np.ndarray, width: int, rank: int, beyond: Literal["edge", "symmetric"]) -> np.ndarray:
    """(T,) the value that `rank` others are below, among the `width` ones, an odd number, around each of x (T,).

    beyond: what is behind the first and last row: that row again ("edge"), or the rows before it in a mirror.
    """
    around = sliding_window_view(np.pad(x, width // 2, mode=beyond), width)
    return np.concatenate([np.partition(around[rows], rank)[:, rank] for rows in blocks(len(x))])


def gaussian(x: np.ndarray, sd: float) -> np.ndarray:
    """x (T, ...), each row the mean of those around it by the weights of a Gaussian whose standard deviation is so many
    rows; beyond the ends they are mirrored."""
    far = int(4 * sd + 0.5)  # as in scipy: rows beyond have no weight
    weights = np.exp(-0.5 / sd**2 * np.arange(-far, far + 1) ** 2)
    weights /= weights.sum()
    beyond = np.pad(x, [(far, far)] + [(0, 0)] * (x.ndim - 1), mode="symmetric")
    total = weights[far] * x
    for off in range(far, 0, -1):
        before, after = (beyond[far + way :][: len(x)] for way in (-off, off))
        total += weights[far + off] * (before + after)
    return total
