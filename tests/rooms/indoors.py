"""Images of rooms with known cameras, as a photograph would show them, drawn from a seed."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from .furniture import Box, above, beam, cable, chair, chest, colour, ladder, paint_all, rope, table, turned
from .plants import leaves
from .shots import Room, angles, taken
from .views import Canvas, Plane, View, held
from .walls import style, wall

X, Y, Z = np.eye(3)


def _floor(canvas: Canvas, rng: np.random.Generator, reach: float, richness: float) -> None:
    """Tiles, boards, carpet or screed; the lines run along the walls, across or at any angle. Walls hide what is
    beyond them."""
    kind = rng.choice(["tiles", "boards", "carpet", "plain"], p=[0.3, 0.3, 0.25, 0.15])
    paint = colour(rng, (0.3, 0.85))
    yaw = rng.choice([0, 0, np.pi / 2, np.pi / 4, rng.uniform(0, np.pi)])
    along, across, _ = turned(yaw)
    plane = Plane(np.zeros(3) - reach * (along + across), along, across)
    square = plane.rect(0, 0, 2 * reach, 2 * reach)
    canvas.textured(square, paint, {"boards": "wood", "carpet": "carpet"}.get(kind, "plaster"))
    if kind in ("tiles", "boards"):
        step = rng.uniform(0.25, 0.6) if kind == "tiles" else rng.uniform(0.09, 0.2)
        joint, groove = rng.uniform(0.003, 0.008), paint * rng.choice([0.55, 0.75, 1.25])
        for at in np.arange(0, 2 * reach, step):
            canvas.fill(plane.rect(0, at, 2 * reach, at + joint), groove.clip(0, 255))
            if kind == "tiles":
                canvas.fill(plane.rect(at, 0, at + joint, 2 * reach), groove.clip(0, 255))
            else:
                end = rng.uniform(0, 2 * reach)
                canvas.fill(plane.rect(end, at, end + joint, at + step), groove.clip(0, 255))
    if rng.random() < 0.3 * richness + 0.1:  # a rug or a mat
        x, y = reach + rng.uniform(-1.5, 1, 2)
        rug = plane.rect(x, y, x + rng.uniform(0.6, 2), y + rng.uniform(0.6, 2), rng.uniform(0, 90))
        canvas.textured(rug, colour(rng, saturation=0.8), "carpet")


def _shadow(canvas: Canvas, box: Box, rng: np.random.Generator) -> None:
    """The shadow of a standing box on the floor."""
    base = Plane(box.middle * [1, 1, 0], box.axes[0], box.axes[1]).rect(*-box.half[:2], *box.half[:2])
    spread = np.concatenate([base, base + np.append(rng.uniform(-0.5, 0.5, 2) * box.half[2], 0)])[:, :2]
    hull = cv2.convexHull(spread.astype(np.float32))[:, 0]
    canvas.shade(np.column_stack([hull, np.zeros(len(hull))]), rng.uniform(0.5, 0.85), 11)


def room(seed: int) -> Room:
    """A room of flats, offices and gyms: walls and floor, furniture turned at any angle, clutter, people."""
    rng = np.random.default_rng([seed, 1])
    tilt, taste = angles(rng), style(rng)
    view = held(rng, *tilt)
    canvas = Canvas(view)
    size = np.array([*rng.uniform(3.2, 9, 2), rng.uniform(2.6, 3.4)])
    # The camera stands where it sees much of the room: the room's middle lies before it.
    middle = view.heading * rng.uniform(0.1, 0.38) * size
    low, high = middle - size / 2, middle + size / 2
    _floor(canvas, rng, size[:2].max() + 2, taste.richness)
    ceiling = Plane(np.array([low[0], low[1], size[2]]), X, Y)
    canvas.textured(ceiling.rect(0, 0, size[0], size[1]), np.full(3, rng.uniform(190, 245)), "plaster")
    for x in np.arange(0.8, size[0] - 0.5, rng.uniform(1.2, 2.5)):  # lamps
        for y in np.arange(0.8, size[1] - 0.5, rng.uniform(1.5, 3)):
            canvas.fill(ceiling.rect(x, y, x + 0.6, y + rng.choice([0.3, 0.6])), np.full(3, 254.0))
    corners = [
        (low[0], low[1], X, 0),
        (high[0], low[1], Y, 1),
        (high[0], high[1], -X, 0),
        (low[0], high[1], -Y, 1),
    ]
    things = []
    for x, y, right, axis in corners:
        paint = np.clip(taste.wall * rng.uniform(0.85, 1.08), 0, 255) if rng.random() < 0.8 else colour(rng)
        own = replace(taste, richness=taste.richness * rng.uniform(0.4, 1), wall=paint)
        things += wall(canvas, rng, Plane(np.array([x, y, 0]), right, Z), size[axis], size[2], own)
    for _ in range(rng.integers(0, 3)):  # sun on the floor
        plane = Plane(middle * [1, 1, 0] + [*rng.uniform(-1.5, 1.5, 2), 0], *turned(rng.uniform(0, 3))[:2])
        canvas.shade(plane.rect(0, 0, 1.2, rng.uniform(0.3, 1)), rng.uniform(1.1, 1.45))
    things += _furniture(canvas, rng, low, high, taste.richness)
    paint_all(canvas, things)
    return taken(canvas, tilt, rng, rng.choice([0, 1, 2], p=[0.3, 0.6, 0.1]))


def _place(rng: np.random.Generator, low: np.ndarray, high: np.ndarray, view: View) -> np.ndarray:
    """A point of the floor within the bounds, before the camera if there is one, and not at its feet."""
    at = np.zeros(3)
    for _ in range(30):
        at = np.append(rng.uniform(low[:2] + 0.4, high[:2] - 0.4), 0)
        if view.heading @ at > 1.3:
            break
    return at


def _furniture(
    canvas: Canvas, rng: np.random.Generator, low: np.ndarray, high: np.ndarray, richness: float
) -> list:
    things, view = [], canvas.view
    for _ in range(rng.poisson(1 + 5 * richness)):
        at, yaw = _place(rng, low, high, view), rng.choice([0, np.pi / 2, rng.uniform(0, np.pi)])
        if view.heading @ at <= 1.3:
            continue
        kind = rng.choice(["table", "chair", "chest", "plant", "heap"], p=[0.25, 0.25, 0.3, 0.1, 0.1])
        if kind == "table":
            things.append(table(rng, at, yaw))
        elif kind == "chair":
            things.append(chair(rng, at, rng.uniform(0, np.pi)))
        elif kind == "chest":
            things.append(chest(rng, at, rng.uniform([0.3, 0.3, 0.2], [1.3, 0.7, 1.5]), yaw))
            _shadow(canvas, things[-1], rng)
        elif kind == "plant":
            height = rng.uniform(0.4, 1)
            things.append(
                leaves(rng, above(at, height), [0.25, 0.25, height / 2], 0.09, 90, np.array([70, 120, 50]))
            )
        else:
            things.append(
                leaves(rng, above(at, 0.15), [0.35, 0.3, 0.15], 0.15, 40, colour(rng, saturation=0.7))
            )
    for _ in range(rng.poisson(1 + 2 * richness)):
        things += _clutter(rng, low, high, view)
    return things


def _clutter(rng: np.random.Generator, low: np.ndarray, high: np.ndarray, view: View) -> list:
    """A stick, a rope, a cable or a ladder that runs along no axis of the room."""
    at = _place(rng, low, high, view)
    if view.heading @ at <= 1.3:
        return []
    kind = rng.choice(["stick", "rope", "cable", "ladder"], p=[0.4, 0.2, 0.3, 0.1])
    lean = at + rng.uniform([-0.5, -0.5, 0.8], [0.5, 0.5, 2.2])
    if kind == "stick":
        return [beam(at, lean, rng.uniform(0.02, 0.05), colour(rng))]
    if kind == "rope":
        other = at + rng.uniform([-2, -2, 0.5], [2, 2, high[2] - 0.2])
        return [rope(lean, other, rng.uniform(0, 0.5), 0.025, colour(rng))]
    if kind == "cable":
        return [cable(rng, at, colour(rng, (0, 0.5)))]
    return [ladder(rng, at, above(lean, 0.3))]
