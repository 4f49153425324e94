"""People and their joints in one picture: what networks that find them give, and what such a network looks like."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..pipeline.layouts import Layout


@dataclass(frozen=True, eq=False)
class Found:
    """One person in one picture, in pixels of the picture; read-only float32.

    xy: (J, 2) joints. score: (J,) in [0, 1]. box: (4,) left, top, right, bottom around the person.
    """

    xy: np.ndarray
    score: np.ndarray
    box: np.ndarray

    def __post_init__(self) -> None:
        for name in ("xy", "score", "box"):
            array = np.array(getattr(self, name), dtype=np.float32)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


class Detector(Protocol):
    """Finds people in pictures, and holds no state.

    method: how results name it, such as "movenet@<hash>". layout: of the joints that it gives.
    people(picture, before): everybody in a picture (H, W, 3) uint8 RGB. before: the people of the frame before, for
        networks that look where somebody was; empty at the first frame and after a cut.
    """

    @property
    def method(self) -> str: ...
    @property
    def layout(self) -> Layout: ...
    def people(self, picture: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]: ...
