"""Images of streets and courtyards with known cameras, drawn from a seed."""

from __future__ import annotations

import cv2
import numpy as np

from .furniture import Box, Group, Patch, above, beam, chest, colour, paint_all, rope, standing, turned
from .plants import tree
from .shots import Room, angles, taken
from .textures import fractal
from .views import Canvas, Plane, View, held
from .walls import Style, front, style

Z = np.array([0, 0, 1.0])


def street(seed: int) -> Room:
    """A street or a courtyard: two rows of houses not always at right angles, pavement, lamp posts, cars, trees."""
    rng = np.random.default_rng([seed, 2])
    tilt, taste = angles(rng), style(rng, ("plaster", "bricks"))
    view = held(rng, *tilt)
    canvas = Canvas(view, background=tuple(np.array([150, 185, 225]) * rng.uniform(0.7, 1.1)))
    clouds = cv2.convertScaleAbs(fractal(int(rng.integers(2**31)), 3.5, side=64), alpha=9, beta=135)
    canvas.gain = cv2.resize(clouds, canvas.gain.shape[::-1], interpolation=cv2.INTER_CUBIC)
    yaw = np.arctan2(view.heading[1], view.heading[0])
    along = yaw + rng.choice([-1, 1]) * rng.uniform(0, 0.6)  # the street's direction, from the view's
    wide = rng.uniform(5, 14)
    second = along + (0 if rng.random() < 0.5 else rng.normal(0, 0.3))
    _ground(canvas, rng, along, wide)
    things = _row(rng, along, wide * rng.uniform(0.3, 0.7) + 1, 1, taste, view)
    things += _row(rng, second, wide * rng.uniform(0.3, 0.7) + 1, -1, taste, view)
    if rng.random() < 0.5:  # a courtyard, or where the street turns
        across = along + np.pi / 2 + rng.choice([0, rng.normal(0, 0.3)])
        things += _row(rng, across, rng.uniform(12, 25), -1, taste, view)
    things += _street_things(rng, along, wide, view, taste.richness)
    paint_all(canvas, things)
    return taken(canvas, tilt, rng, rng.choice([0, 1, 2], p=[0.3, 0.5, 0.2]))


def _ground(canvas: Canvas, rng: np.random.Generator, along: float, wide: float) -> None:
    """Asphalt with pavements of slabs on both sides, their kerbs, and marks on the road."""
    u, v, _ = turned(along)
    plane = Plane(-60 * u - 60 * v, u, v)
    canvas.textured(plane.rect(0, 0, 180, 120), np.full(3, rng.uniform(80, 150)), "asphalt")
    slab, paint, joint = rng.uniform(0.3, 0.8), colour(rng, (0.45, 0.8), 0.15), rng.uniform(0.005, 0.015)
    for side in (-1, 1):
        edge = side * wide * 0.3
        low, high = sorted((60 + edge, 60 + edge + 12 * side))
        canvas.textured(plane.rect(0, low, 180, high), paint, "asphalt")
        canvas.fill(plane.rect(0, 60 + edge - 0.08, 180, 60 + edge + 0.08), 1.15 * paint.clip(0, 220))
        for x in np.arange(50, 85, slab):
            canvas.fill(plane.rect(x, low, x + joint, high), 0.6 * paint)
        for y in np.arange(slab, 6, slab) * side + 60 + edge:
            canvas.fill(plane.rect(40, y, 110, y + joint), 0.6 * paint)
    for x in map(float, range(52, 100, 5)) if rng.random() < 0.5 else ():
        canvas.fill(plane.rect(x, 59.93, x + 2.5, 60.07), np.full(3, 225.0))


def _row(
    rng: np.random.Generator, along: float, away: float, side: int, taste: Style, view: View
) -> list[Group]:
    """Houses whose fronts stand in a line, metres away to the left (side 1) or right of the camera; none behind it."""
    u, v, _ = turned(along)
    houses, x, storey = [], rng.uniform(-12, -4), rng.uniform(2.8, 3.4)
    while x < 45:
        width, depth = rng.uniform(5, 14), rng.uniform(7, 9)
        height = storey * rng.integers(2, 6) + 0.4
        at = (x + width / 2) * u + side * (away + depth / 2 + rng.choice([0, 0, 0.6])) * v
        texture = str(rng.choice([taste.texture, "plaster"]))
        paint = colour(rng, (0.5, 0.95), 0.3 if rng.random() < 0.7 else 0.7)
        house = standing(at, (width, depth, height), along, paint, front(rng, taste, storey, width), texture)
        if view.heading @ at > -9:
            houses.append(Group([Group(_roof(rng, house)), house], layered=True))
        x += width + (rng.uniform(1, 6) if rng.random() < 0.2 else 0)
    return houses


def _roof(rng: np.random.Generator, house: Box) -> list[Patch]:
    """A ridge over the middle of the house: two slopes and a gable at each end."""
    u, v, _ = house.axes * house.half[:, None]
    top, paint = house.middle + house.half[2] * Z, colour(rng, (0.25, 0.6), 0.6)
    ridge = top + rng.uniform(1.5, 4) * Z
    slopes = [Patch(np.stack([top - u + s * v, top + u + s * v, ridge + u, ridge - u]), paint * (0.9 + 0.1 * s))
              for s in (-1, 1)]  # fmt: skip
    gables = [Patch(np.stack([top + s * u - v, top + s * u + v, ridge + s * u]), 0.8 * house.paint_colour)
              for s in (-1, 1)]  # fmt: skip
    return gables + slopes


def _street_things(rng: np.random.Generator, along: float, wide: float, view: View, richness: float) -> list:
    u, v, _ = turned(along)
    things = []
    for _ in range(rng.poisson(4 + 4 * richness)):
        at = rng.uniform(4, 30) * u + rng.choice([-1, 1]) * wide * rng.uniform(0.15, 0.36) * v
        if np.linalg.norm(at) < 3.5 or view.heading @ at < 2.5:
            continue
        kind = rng.choice(["car", "lamp", "tree", "bin", "cable"], p=[0.25, 0.12, 0.38, 0.1, 0.15])
        if kind == "car":
            things.append(car(rng, at, along + rng.normal(0, 0.08) + rng.choice([0, np.pi])))
        elif kind == "lamp":
            top, paint = at + rng.uniform(3.5, 6) * Z, np.full(3, rng.uniform(30, 140))
            things.append(Group([beam(at, top, 0.1, paint), beam(top, top - 0.8 * v + 0.1 * Z, 0.07, paint)]))
        elif kind == "tree":
            things.append(tree(rng, at, rng.uniform(3.5, 9), abs(rng.normal(0, 0.12))))
        elif kind == "bin":
            things.append(chest(rng, at, rng.uniform([0.4, 0.4, 0.7], [1.5, 1, 1.4]), rng.uniform(0, np.pi)))
        else:
            ends = [at + rng.uniform(-10, 10) * u + s * wide * v + rng.uniform(4, 7) * Z for s in (-0.5, 0.5)]
            things.append(rope(ends[0], ends[1], rng.uniform(0.2, 1), 0.04, np.full(3, 30.0)))
    return things


def car(rng: np.random.Generator, at: np.ndarray, yaw: float) -> Group:
    """At a point (3,): a car of two boxes with windows, on dark wheels."""
    paint, axes = colour(rng, saturation=0.9), turned(yaw)
    glass = np.array([40, 45, 50])

    def windows(canvas: Canvas, plane: Plane, width: float, height: float) -> None:
        for x in np.linspace(0, width, 4 if width > 2 else 2)[:-1]:
            step = width / (3 if width > 2 else 1)
            corners = plane.rect(x + 0.06, 0.05, x + step - 0.06, height - 0.08)
            canvas.fill(corners, glass)

    wheels = [standing(at + x * axes[0] + y * axes[1], (0.6, 0.2, 0.6), yaw, np.array([25, 25, 25]))
              for x in (-1.3, 1.3) for y in (-0.8, 0.8)]  # fmt: skip
    body = standing(above(at, 0.3), (4.2, 1.75, 0.65), yaw, paint)
    cabin = standing(above(at, 0.95) - 0.2 * axes[0], (2.3, 1.55, 0.5), yaw, paint, windows)
    return Group([Group(wheels), body, cabin], layered=True)
