"""Where a video goes on with another scene."""

from __future__ import annotations

import numpy as np

_SIDE = 32
_ALIKE = 0.6  # correlation of two small pictures below which they show different scenes
_FLAT = 2.0  # deviation of grey values below which a picture shows nothing to compare


def thumbnail(picture: np.ndarray) -> np.ndarray:
    """A picture (H, W, 3) uint8 as (32, 32) uint8 grey values, whatever its shape."""
    import cv2

    small = cv2.resize(picture, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)


def is_cut(before: np.ndarray, now: np.ndarray) -> bool:
    """Whether two small pictures (32, 32) of successive frames show different scenes. Brighter, darker or a flash is
    none; nor is a picture of one colour, so whoever asks keeps the last that shows something (`shows`)."""
    if not (shows(before) and shows(now)):
        return False
    return float(np.corrcoef(before.ravel(), now.ravel())[0, 1]) < _ALIKE


def shows(small: np.ndarray) -> bool:
    """Whether there is anything in a small picture (32, 32)."""
    return float(small.std()) > _FLAT
