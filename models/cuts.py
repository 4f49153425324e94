"""Where a video goes on with another scene."""

from __future__ import annotations

import numpy as np

_SIDE = 32
_SAMPLES = (
    64  # of each side that are looked at, at least: averaging all pixels would cost more than what follows
)
_ALIKE = 0.6  # correlation of two small pictures below which they show different scenes
_FLAT = 2.0  # deviation of grey values below which a picture shows nothing to compare


def thumbnail(picture: np.ndarray) -> np.ndarray:
    """A picture (H, W, 3) uint8 as (32, 32) uint8 grey values, whatever its shape."""
    import cv2

    down, right = (max(side // _SAMPLES, 1) for side in picture.shape[:2])
    samples = np.ascontiguousarray(picture[::down, ::right])
    small = cv2.resize(samples, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_RGB2GRAY)


def is_cut(before: np.ndarray, now: np.ndarray) -> bool:
    """Whether two small pictures (32, 32) of successive frames show different scenes. Brighter, darker or a flash is
    none; nor is a picture of one colour, so whoever asks keeps the last that shows something (`shows`)."""
    if not (shows(before) and shows(now)):
        return False
    a, b = (small.ravel() - small.mean(dtype=np.float32) for small in (before, now))
    return float(a @ b) < _ALIKE * float(np.linalg.norm(a) * np.linalg.norm(b))


def shows(small: np.ndarray) -> bool:
    """Whether there is anything in a small picture (32, 32)."""
    return float(small.std()) > _FLAT
