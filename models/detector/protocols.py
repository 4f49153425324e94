"""People and their joints in one image: what networks that find them give, what such networks look like, and the parts
of an image that they look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...pipeline.core.layouts import Layout

LOST = 0.3  # less sure than this of a look at one person, nobody is there


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


@dataclass(frozen=True, eq=False)
class Found:
    """One person in one image, in pixels of the image; read-only float32.

    xy: (J, 2) joints. score: (J,) in [0, 1]. box: (4,) left, top, right, bottom around the person.
    sure: in [0, 1], how much it looks like a person at all.
    """

    xy: np.ndarray
    score: np.ndarray
    box: np.ndarray
    sure: float = 1.0

    def __post_init__(self) -> None:
        for name in ("xy", "score", "box"):
            array = np.array(getattr(self, name), dtype=np.float32)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


class Detector(Protocol):
    """Finds people in images, and holds no state.

    method: how results name it, such as "movenet@<hash>". layout: of the joints that it gives.
    people(image, before): everybody in an image (H, W, 3) uint8 RGB. before: the people of the frame before, for
        networks that look where somebody was; empty at the first frame and after a cut.
    """

    @property
    def method(self) -> str: ...
    @property
    def layout(self) -> Layout: ...
    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]: ...


class CropNetwork(Protocol):
    """A network that finds the joints of the person in a part of the image.

    aspect: width over height of that part. room: its size over that of a box around the person.
    look(image, crop): what it takes for the person there, sure or not.
    next_crop(person): where to look in the next frame.
    """

    aspect: float
    room: float

    @property
    def method(self) -> str: ...
    @property
    def layout(self) -> Layout: ...
    def look(self, image: np.ndarray, crop: Crop) -> Found: ...
    def next_crop(self, person: Found) -> Crop: ...


class PersonNetwork(Protocol):
    """A network that finds people. boxes(image): (N, 4) left, top, right, bottom in pixels."""

    @property
    def method(self) -> str: ...
    def boxes(self, image: np.ndarray) -> np.ndarray: ...
