"""Parts of an image as a network wants them, and where the network's answers lie in the image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Crop:
    """A rectangle of the image in whole pixels; it may reach beyond the image, which is black there."""

    left: int
    top: int
    width: int
    height: int

    def cut(self, image: np.ndarray, size: tuple[int, int], fill: int = 0) -> np.ndarray:
        """(size[1], size[0], 3) uint8: the part of an image (H, W, 3), scaled to width and height `size`.

        fill: the grey beyond the image.
        """
        import cv2

        height, width = image.shape[:2]
        left, right = max(self.left, 0), min(self.left + self.width, width)
        top, bottom = max(self.top, 0), min(self.top + self.height, height)
        if left >= right or top >= bottom:
            return np.full((size[1], size[0], 3), fill, dtype=np.uint8)
        part = image[top:bottom, left:right]
        if (right - left, bottom - top) != (self.width, self.height):
            above, below = top - self.top, self.top + self.height - bottom
            before, after = left - self.left, self.left + self.width - right
            grey = (fill, fill, fill)
            part = cv2.copyMakeBorder(part, above, below, before, after, cv2.BORDER_CONSTANT, value=grey)
        shrinks = self.width * self.height > size[0] * size[1]
        return cv2.resize(part, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR)

    def in_image(self, shares: np.ndarray) -> np.ndarray:
        """(..., 2) pixels of the image from shares of the crop's width and height."""
        return shares * (self.width, self.height) + (self.left, self.top)


def around(centre: np.ndarray, width: float, height: float) -> Crop:
    """The crop of that size, at least 2 pixels, around a point (2,)."""
    width, height = max(round(float(width)), 2), max(round(float(height)), 2)
    left, top = round(float(centre[0]) - width / 2), round(float(centre[1]) - height / 2)
    return Crop(left, top, width, height)


def fitted(box: np.ndarray, aspect: float, room: float = 1.0) -> Crop:
    """The smallest crop of that width over height around a box (4,) that has been made `room` times larger."""
    width, height = room * (box[2] - box[0]), room * (box[3] - box[1])
    return around((box[:2] + box[2:]) / 2, max(width, height * aspect), max(height, width / aspect))


def box_around(xy: np.ndarray) -> np.ndarray:
    """(4,) left, top, right, bottom of points (N, 2)."""
    return np.concatenate([xy.min(axis=0), xy.max(axis=0)])
