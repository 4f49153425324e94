"""Where a video goes on with another scene."""

from __future__ import annotations

import numpy as np

_SIDE = 32
_SAMPLES = 64  # a side, that are looked at: averaging all pixels would cost more than what follows
_ALIKE = 0.6  # correlation of two small images below which they show different scenes
_SAME = 8.0  # grey values by which what stays where it is differs from one image to a later one at most
_STAYS = 0.5  # of the image: who walks through a room, or comes near, leaves more of it as it was
_FLAT = 2.0  # deviation of grey values below which an image shows nothing to compare


class Glance:
    """What is kept of an image to compare it with the next.

    small: (32, 32) uint8 grey values, whatever the image's shape. shows: whether there is anything in it.
    """

    def __init__(self, small: np.ndarray) -> None:
        self.small = small
        off = small.ravel() - small.mean(dtype=np.float32)
        length = float(np.sqrt(off @ off))
        self.shows = length > _FLAT * _SIDE
        self._pattern = off / length if self.shows else off

    @classmethod
    def at(cls, image: np.ndarray) -> Glance:
        """At an image (H, W, 3) uint8."""
        import cv2

        samples = cv2.resize(image, (_SAMPLES, _SAMPLES), interpolation=cv2.INTER_NEAREST)
        small = cv2.resize(samples, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
        return cls(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY))

    def is_cut_to(self, now: Glance) -> bool:
        """Whether the next image shows another scene. Brighter, darker or a flash is none; nor is an image of one
        colour, so the caller keeps the last that `shows` something."""
        if not (self.shows and now.shows) or float(self._pattern @ now._pattern) >= _ALIKE:
            return False
        change = np.abs(self.small.astype(np.float32) - now.small)
        return float((change < _SAME).mean()) < _STAYS
