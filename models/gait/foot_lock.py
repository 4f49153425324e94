"""Foot lock: a pelvis path on which feet that stand do not slide.

While a foot lies flat its ankle stays where it is, so what an estimated path makes it move by there is an error of the
path or of the leg. The path alone takes the correction, and no leg is bent for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain

import numpy as np

from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import runs
from .events import Stance
from .parameters import belt_drift, flat_span

_MOST = 2.5  # standard deviations that a correction may be: nine in ten Gaussian errors in space are less


def foot_locked(
    root: np.ndarray,
    ankles: Mapping[str, np.ndarray],
    covariance: Mapping[str, np.ndarray],
    feet: Mapping[str, Sequence[Stance]],
    time_s: np.ndarray,
    seams: Sequence[int] = (),
) -> np.ndarray:
    """(T, 3) the path on which the ankle of each foot that lies flat stays in one place, the mean of those it has.

    root: (T, 3) an estimated path in LEVEL. ankles: (T, 3) by side "r" and "l" relative to it, in the same axes and
    unit. covariance: (T, 3, 3) by side of the error of the ankle's place, the path's and the leg's together. feet:
    stances by side. time_s: (T,). NaN where missing.

    Where both feet lie flat the one that did first is held. Between two such times the correction goes evenly from one
    to the other (a monotone cubic), never across a gap or a seam; it stays as it is before the first and after the
    last. A foot that would have to be moved by more than its stated error slides, and is left alone; all are where a
    belt carries them.
    """
    floor = {side: ankle[:, :2] for side, ankle in ankles.items()}
    if belt_drift(root[:, :2], floor, time_s, feet, seams) is not None:
        return root
    correction = np.full(root.shape, np.nan)
    for side, rows in flat_rows(feet, is_finite(root), time_s, seams):
        place = root[rows] + ankles[side][rows]
        off = place.mean(axis=0) - place
        if len(off) > 1 and np.isfinite(off).all() and _size(off, covariance[side][rows]).max() <= _MOST:
            correction[rows] = off
    return root + _spread(correction, is_finite(root), time_s, seams)


def flat_rows(
    feet: Mapping[str, Sequence[Stance]], seen: np.ndarray, time_s: np.ndarray, seams: Sequence[int]
) -> Iterator[tuple[str, slice]]:
    """Side and rows of the foot that lies flat, one foot at a time, in order. feet: stances by side; seen: (T,) rows in
    which its place is known; time_s: (T,)."""
    spans = []
    for piece in runs(seen, time_s, seams):
        for stance in chain.from_iterable(feet.values()):
            first_s = max(float(time_s[piece.start]), stance.seen_s[0])
            last_s = min(float(time_s[piece.stop - 1]), stance.seen_s[1])
            ends = [end_s for end_s in (stance.start_s, stance.stop_s) if np.isfinite(end_s)]
            if first_s < last_s and all(first_s <= end_s <= last_s for end_s in ends):
                spans.append((*flat_span(stance, first_s, last_s), stance.side))
    free = 0
    for start_s, stop_s, side in sorted(spans):
        first, stop = np.searchsorted(time_s, (start_s, stop_s))
        rows = slice(max(int(first), free), int(stop))
        if rows.start < rows.stop:
            free = rows.stop
            yield side, rows


def _size(off: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(N,) of corrections (N, 3) in standard deviations; infinite where no error is stated."""
    stated = np.asarray(np.isfinite(covariance).all(axis=(1, 2)))
    certain = np.where(stated[:, None, None], covariance, np.eye(3)).astype(np.float64)
    square = np.einsum("ni,ni->n", off, np.linalg.solve(certain, off[..., None])[..., 0])
    return np.where(stated, np.sqrt(square), np.inf)


def _spread(correction: np.ndarray, seen: np.ndarray, time_s: np.ndarray, seams: Sequence[int]) -> np.ndarray:
    """(T, 3) corrections, NaN where no foot lies flat, spread over the unbroken pieces of seen rows (T,)."""
    from scipy.interpolate import PchipInterpolator

    result = np.zeros(correction.shape)
    for piece in runs(seen, time_s, seams):
        held = np.asarray(is_finite(correction[piece]))
        if held.any():
            at_s = time_s[piece][held]
            between = PchipInterpolator(at_s, correction[piece][held])
            result[piece] = between(np.clip(time_s[piece], at_s[0], at_s[-1]))
    return result
