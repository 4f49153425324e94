"""People and their joints in one image: what networks that find them give, and what such networks look like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...pipeline.core.layouts import Layout
from .crops import Crop

LOST = 0.3  # less sure than this of a look at one person, nobody is there


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
