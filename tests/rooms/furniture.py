"""Things that stand in rooms and streets: each has a middle, by which they are painted from far to near."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from .views import Canvas, Plane

LIGHT = np.array([0.3, 0.5, 0.8])  # world; the side from which faces are brighter


def colour(rng: np.random.Generator, value=(0.3, 0.95), saturation: float = 0.35) -> np.ndarray:
    """A paint: (3,) RGB, 0 to 255."""
    hsv = rng.random(), saturation * rng.random(), rng.uniform(*value)
    return 255 * np.array(colorsys.hsv_to_rgb(*hsv))


def turned(yaw: float) -> np.ndarray:
    """(3, 3) rows: the axes of a thing turned about the vertical by radians."""
    return np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])


def above(at, height: float) -> np.ndarray:
    """The point (3,) metres above another."""
    return np.asarray(at) + np.array([0, 0, height])


@dataclass(eq=False)
class Box:
    """middle, half the edges and the axes (rows). details paints on a standing face, given its plane and size."""

    middle: np.ndarray
    half: np.ndarray
    axes: np.ndarray
    paint_colour: np.ndarray
    details: Callable[[Canvas, Plane, float, float], None] | None = None
    texture: str | None = None

    def paint(self, canvas: Canvas) -> None:
        for i in range(3):
            for sign in (-1, 1):
                normal = sign * self.axes[i]
                face = self.middle + normal * self.half[i]
                if normal @ (canvas.view.position - face) > 0:
                    self._face(canvas, face, normal, *((1, 2), (0, 2), (0, 1))[i])

    def _face(self, canvas: Canvas, face: np.ndarray, normal: np.ndarray, across: int, along: int) -> None:
        a, b = self.half[across], self.half[along]
        corner = face - a * self.axes[across] - b * self.axes[along]
        plane = Plane(corner, self.axes[across], self.axes[along])
        shaded = self.paint_colour * (0.72 + 0.28 * normal @ LIGHT)
        corners = plane.rect(0, 0, 2 * a, 2 * b)
        if self.texture:
            canvas.textured(corners, shaded, self.texture, along=int(b > a))
        else:
            canvas.fill(corners, shaded)
        if self.details and along == 2:
            self.details(canvas, plane, 2 * a, 2 * b)


@dataclass(eq=False)
class Group:
    """Parts that are painted together: layered, each over the one before it, or from far to near."""

    parts: list
    layered: bool = False

    @property
    def middle(self) -> np.ndarray:
        return np.mean([part.middle for part in self.parts], axis=0)

    def paint(self, canvas: Canvas) -> None:
        if self.layered:
            for part in self.parts:
                part.paint(canvas)
        else:
            paint_all(canvas, self.parts)


def paint_all(canvas: Canvas, things: Iterable) -> None:
    """Paint things from far to near."""
    for thing in sorted(things, key=lambda thing: -np.linalg.norm(thing.middle - canvas.view.position)):
        thing.paint(canvas)


def standing(at, size, yaw: float, paint, details=None, texture=None) -> Box:
    """A box of size (width, depth, height) standing with the middle of its base at (3,)."""
    half = np.asarray(size) / 2
    return Box(above(at, half[2]), half, turned(yaw), paint, details, texture)


def beam(a: np.ndarray, b: np.ndarray, thick: float, paint: np.ndarray) -> Box:
    """A square stick from a (3,) to b (3,)."""
    axis = (b - a) / np.linalg.norm(b - a)
    side = np.cross(axis, [0.3, 0.9, 0.1] if abs(axis[2]) > 0.9 else [0, 0, 1.0])
    side /= np.linalg.norm(side)
    half = np.array([thick / 2, thick / 2, np.linalg.norm(b - a) / 2])
    return Box((a + b) / 2, half, np.stack([side, np.cross(axis, side), axis]), paint)


@dataclass(eq=False)
class Patch:
    """A convex polygon (n, 3) with a texture or none, seen from both sides."""

    corners: np.ndarray
    paint_colour: np.ndarray
    texture: str | None = None

    @property
    def middle(self) -> np.ndarray:
        return self.corners.mean(axis=0)

    def paint(self, canvas: Canvas) -> None:
        if self.texture:
            canvas.textured(self.corners, self.paint_colour, self.texture)
        else:
            canvas.fill(self.corners, self.paint_colour)


@dataclass(eq=False)
class Rope:
    """A rope or cable through points (n, 3)."""

    points: np.ndarray
    thick: float
    paint_colour: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        return self.points.mean(axis=0)

    def paint(self, canvas: Canvas) -> None:
        toward = canvas.view.position - self.points[:-1]
        side = np.cross(np.diff(self.points, axis=0), toward)
        side *= self.thick / 2 / (np.linalg.norm(side, axis=1, keepdims=True) + 1e-9)
        for a, b, s in zip(self.points, self.points[1:], side, strict=False):
            canvas.fill(np.stack([a - s, b - s, b + s, a + s]), self.paint_colour)


def rope(a: np.ndarray, b: np.ndarray, sag: float, thick: float, paint: np.ndarray) -> Rope:
    """A rope that hangs from a (3,) to b (3,), its middle lower by metres."""
    t = np.linspace(0, 1, 13)[:, None]
    return Rope(a + t * (b - a) - 4 * sag * t * (1 - t) * [0, 0, 1.0], thick, paint)


def cable(rng: np.random.Generator, at: np.ndarray, paint: np.ndarray) -> Rope:
    """A cable that winds along the floor from a point (3,)."""
    heading = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(0, 0.35, 16))
    steps = 0.18 * np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1)
    return Rope(above(at, 0.01) + np.cumsum(steps, axis=0), 0.02, paint)


def table(rng: np.random.Generator, at, yaw: float) -> Group:
    """A table, a bench or a stool: a top on four legs."""
    width, depth, height = rng.uniform(0.4, 1.9), rng.uniform(0.4, 0.9), rng.uniform(0.42, 0.95)
    wood, axes = colour(rng), turned(yaw)
    legs = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot = at + sx * (width / 2 - 0.05) * axes[0] + sy * (depth / 2 - 0.05) * axes[1]
            top = foot - rng.choice([0, 0.06]) * (sx * axes[0] + sy * axes[1])
            legs.append(beam(foot, above(top, height), 0.05, 0.8 * wood))
    top = standing(above(at, height), (width, depth, 0.04), yaw, wood, texture="wood")
    things = [
        standing(at + np.append(rng.uniform(-0.2, 0.2, 2), height + 0.04), rng.uniform(0.05, 0.3, 3), rng.uniform(0, 3),
                 colour(rng)) for _ in range(rng.integers(4))
    ]  # fmt: skip
    return Group([Group(legs), top, *things], layered=True)


def chair(rng: np.random.Generator, at, yaw: float) -> Group:
    """A chair at a point (3,) of the floor, turned by radians."""
    paint, axes = colour(rng), turned(yaw)
    feet = [at + 0.2 * (sx * axes[0] + sy * axes[1]) for sx in (-1, 1) for sy in (-1, 1)]
    legs = [beam(foot, above(foot, 0.44) + 0.04 * (at - foot), 0.03, 0.6 * paint) for foot in feet]
    seat = standing(above(at, 0.44), (0.44, 0.44, 0.04), yaw, paint)
    lean = above(at, 0.48) + 0.2 * axes[1]
    back = [beam(lean + x * axes[0], lean + x * axes[0] + 0.08 * axes[1] + [0, 0, 0.4], 0.03, 0.7 * paint)
            for x in (-0.2, -0.07, 0.07, 0.2)]  # fmt: skip
    top = beam(lean - 0.2 * axes[0] + [0, 0, 0.38], lean + 0.2 * axes[0] + [0, 0, 0.38], 0.05, paint)
    return Group([Group(legs), seat, Group([*back, top])], layered=True)


def chest(rng: np.random.Generator, at, size, yaw: float) -> Box:
    """A chest of drawers, a locker, a carton: a box with lines or none on its faces."""
    columns, rows = rng.integers(1, 4), rng.integers(1, 6)
    plain, dark = rng.random() < 0.4, 0.6

    def details(canvas: Canvas, plane: Plane, width: float, height: float) -> None:
        if plain:
            return
        for x in np.linspace(0, width, columns + 1)[1:-1]:
            canvas.fill(plane.rect(x - 0.006, 0, x + 0.006, height), paint * dark)
        for y in np.linspace(0, height, rows + 1)[1:-1]:
            canvas.fill(plane.rect(0, y - 0.006, width, y + 0.006), paint * dark)

    paint = colour(rng)
    return standing(at, size, yaw, paint, details, ("wood", "cloth", None)[int(rng.integers(3))])


def ladder(rng: np.random.Generator, foot: np.ndarray, top: np.ndarray) -> Group:
    """A ladder that leans, from its foot (3,) to its top (3,)."""
    paint = colour(rng, saturation=0.6)
    side = np.cross(top - foot, [0, 0, 1.0])
    side *= 0.2 / np.linalg.norm(side)
    rungs = np.linspace(0.06, 0.94, int(np.linalg.norm(top - foot) / 0.28))[:, None]
    rungs = foot + rungs * (top - foot)
    return Group([beam(foot + s, top + s, 0.05, paint) for s in (-side, side)]
                 + [beam(rung - side, rung + side, 0.03, paint) for rung in rungs])  # fmt: skip
