"""Cuts within a scene, where images were taken out or the picture enlarged: all that is seen leaps at once."""

from __future__ import annotations

import numpy as np

from ...pipeline.files.detections import MOVES, Detections
from ...pipeline.signals.tracker import steps
from ...pipeline.signals.visibility import LEAST_SCORE

# Joints and image change this many times as much as in each of the images beside, and joints move by that much of the
# body's size. Where two seconds were cut out, or the picture was enlarged 1.3 times, both changed 3 times as much or
# more; in ninety other clips, films among them, never 1.6 times.
_TIMES, _BESIDE, _STEP = 2.0, 3, 0.04


def leaps(found: Detections) -> np.ndarray:
    """(L,) frames at which somebody and the image leap, and neither before nor after it."""
    frames = set[int]()
    change = found.change.astype(np.float64)
    change[found.repeated] = np.nan
    seen = np.where((found.confidence < LEAST_SCORE)[..., None], np.nan, found.joints).astype(np.float64)
    for person in np.unique(found.person):
        rows = np.flatnonzero(found.person == person)
        if len(rows) <= 2 * _BESIDE + 1:
            continue
        at = found.frame_index[rows[1:]]
        went = np.where(np.diff(found.frame_index[rows]) == 1, steps(seen[rows]), np.nan)
        large = (went >= np.maximum(_STEP, _TIMES * _beside(went))) & (
            change[at] >= np.maximum(MOVES, _TIMES * _beside(change[at]))
        )
        frames |= set(at[large].tolist())
    return np.array(sorted(frames), np.int64)


def _beside(values: np.ndarray) -> np.ndarray:
    """(T,) the largest of the three values on either side of each of (T,); NaN where one of them is not known."""
    result = np.full(len(values), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * _BESIDE + 1)
    result[_BESIDE:-_BESIDE] = np.delete(windows, _BESIDE, axis=1).max(axis=1)
    return result
