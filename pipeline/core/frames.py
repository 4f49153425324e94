"""Coordinate frames as data: axes in words, origin and unit, carried with every array.

A frame belongs to a family (camera, image, world, level, body). Inside a family a change of frame is a
fixed signed permutation that follows from the words; between families it needs a rotation that somebody
has estimated. design.md sections 3 and 4, formats.md (frame table at its head).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .errors import InputError

# Each family's words for directions, as vectors of that family's reference axes, and those for the opposite ones.
_DIRECTIONS: dict[str, dict[str, tuple[float, ...]]] = {
    "camera": {"right": (1, 0, 0), "down": (0, 1, 0), "away": (0, 0, 1)},
    "image": {"right": (1, 0), "down": (0, 1)},
    "world": {"north": (1, 0, 0), "west": (0, 1, 0), "up": (0, 0, 1)},
    "level": {"back": (1, 0, 0), "right": (0, 1, 0), "up": (0, 0, 1)},
    "body": {"back": (1, 0, 0), "right": (0, 1, 0), "up": (0, 0, 1)},
}
_OPPOSITE = {
    "right": "left", "down": "up", "away": "toward", "north": "south", "west": "east", "up": "down", "back": "front",
}  # fmt: skip
for _words in _DIRECTIONS.values():
    _words |= {_OPPOSITE[word]: tuple(-x for x in vector) for word, vector in _words.items()}
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": 0.0254}
UNITS = (*METRES, "px", "arbitrary")


@dataclass(frozen=True)
class Frame:
    """Axes (what +x, +y, +z point at), origin and unit of an array of points.

    family: "camera", "image", "world" (gravity known, heading arbitrary), "level" or "body".
    origin: "pelvis", "camera", "world", "image corner", or words for a place that says nothing.
    unit: "m", "mm", "cm", "inch", "px" or "arbitrary" (the source has no scale).
    """

    name: str
    family: str
    axes: tuple[str, ...]
    origin: str = "pelvis"
    unit: str = "m"

    def __post_init__(self) -> None:
        if self.unit not in UNITS:
            raise InputError("bad-value", f"Expected a unit of {', '.join(UNITS)}; got '{self.unit}'.")
        directions, square = _DIRECTIONS.get(self.family, {}), (self.dims, self.dims)
        known = directions.keys() >= {*self.axes} and self.basis.shape == square
        if not known or abs(np.linalg.det(self.basis)) < 0.5:
            own = f", with as many independent axes of its directions ({', '.join(directions)})"
            raise InputError(
                "bad-value",
                f"Expected a frame of {', '.join(_DIRECTIONS)}{own if directions else ''}; got {self.family} and "
                f"{', '.join(self.axes)}.",
            )

    @property
    def basis(self) -> np.ndarray:
        """(D, D): row i is this frame's axis i in the family's reference axes."""
        return np.array([_DIRECTIONS[self.family][word] for word in self.axes], dtype=float)

    @property
    def dims(self) -> int:
        return len(self.axes)

    @property
    def right_handed(self) -> bool:
        return bool(np.linalg.det(self.basis) > 0)

    @property
    def metric(self) -> bool:
        return self.unit in METRES

    def with_(self, *, origin: str | None = None, unit: str | None = None) -> Frame:
        return replace(self, origin=origin or self.origin, unit=unit or self.unit)

    def __str__(self) -> str:
        axes = ", ".join(f"{axis} {word}" for axis, word in zip("xyz", self.axes, strict=False))
        hand = "" if self.dims == 2 else ", right-handed" if self.right_handed else ", left-handed"
        unit = "no known scale" if self.unit == "arbitrary" else self.unit
        return f"{self.name} ({axes}{hand}; origin {self.origin}; {unit})"


CAMERA = Frame("CAMERA", "camera", ("right", "down", "away"))
GL_CAMERA = Frame("GL_CAMERA", "camera", ("right", "up", "toward"))
PC_CAMERA = Frame("PC_CAMERA", "camera", ("away", "left", "up"))  # the paper's axes, formats.md "PC frame"
IMAGE = Frame("IMAGE", "image", ("right", "down"), origin="image corner", unit="px")
Z_UP = Frame("Z_UP", "world", ("north", "west", "up"), origin="world")
# (x,y,z) -> (z,x,y), formats.md section 8.
Y_UP = Frame("Y_UP", "world", ("west", "up", "north"), origin="world")
LEVEL = Frame("LEVEL", "level", ("back", "right", "up"))
BODY = Frame("BODY", "body", ("back", "right", "up"))

FRAMES = {frame.name: frame for frame in (CAMERA, GL_CAMERA, PC_CAMERA, IMAGE, Z_UP, Y_UP, LEVEL, BODY)}


def require(frame: Frame, expected: Frame, what: str) -> None:
    """Raise InputError unless `frame` has the axes of `expected`; unit and origin may differ."""
    if (frame.family, frame.axes) != (expected.family, expected.axes):
        raise InputError(
            "wrong-axes", f"{what} needs points in {expected}, got {frame}; use change_frame first."
        )
