"""Walls of rooms and fronts of houses, with what is on them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .furniture import Box, colour, standing
from .views import Canvas, Plane

WHITE = np.array([235, 233, 228])


@dataclass(frozen=True, eq=False)
class Style:
    """How a room or a street is furnished: richness 0 (bare) to 1, paints (3,), texture of walls, window bars."""

    richness: float
    wall: np.ndarray
    trim: np.ndarray
    texture: str
    bars: tuple[int, int]


def style(rng: np.random.Generator, textures=("plaster", "plaster", "plaster", "bricks")) -> Style:
    """How a room or a street is furnished, its walls of one of the textures."""
    richness = float(rng.choice([0.0, 0.25, 0.5, 0.8, 1.0], p=[0.1, 0.2, 0.3, 0.25, 0.15]))
    trim = WHITE * rng.uniform(0.8, 1) if rng.random() < 0.6 else colour(rng, (0.2, 0.6), 0.6)
    bars = int(rng.integers(1, 4)), int(rng.integers(1, 4))
    paint = colour(rng, (0.6, 0.97), 0.12 if rng.random() < 0.7 else 0.45)
    return Style(richness, paint, trim, str(rng.choice(textures)), bars)


def panes(canvas: Canvas, plane: Plane, rng, box: tuple[float, float, float, float], taste: Style) -> None:
    """A window: frame, panes that show the sky or the dark, bars between them, sometimes a blind."""
    x0, y0, x1, y1 = box
    if not len(canvas.seen(plane.rect(x0 - 0.1, y0 - 0.1, x1 + 0.1, y1 + 0.1))):
        return
    canvas.fill(plane.rect(x0 - 0.06, y0 - 0.06, x1 + 0.06, y1 + 0.06), taste.trim)
    canvas.fill(plane.rect(x0 - 0.06, y0 - 0.1, x1 + 0.06, y0 - 0.06), 0.6 * taste.trim)
    xs, ys = np.linspace(x0, x1, taste.bars[0] + 1), np.linspace(y0, y1, taste.bars[1] + 1)
    glass = rng.choice([40, 90, 210, 250]) * rng.uniform(0.9, 1, 3)
    for a, b in pairwise(xs):
        for c, d in pairwise(ys):
            canvas.fill(
                plane.rect(a + 0.025, c + 0.025, b - 0.025, d - 0.025), glass * rng.uniform(0.8, 1.02)
            )
    if rng.random() < 0.25:
        down = y1 - rng.uniform(0.1, 0.7) * (y1 - y0)
        paint = colour(rng, (0.5, 0.9))
        canvas.textured(plane.rect(x0, down, x1, y1), paint, "cloth")
        for y in np.arange(down, y1, 0.08) if rng.random() < 0.6 else ():
            canvas.fill(plane.rect(x0, y, x1, y + 0.02), 0.7 * paint)


def door(canvas: Canvas, plane: Plane, rng, x: float, taste: Style) -> float:
    """A door from x metres on, closed or open; its width."""
    width, height = rng.uniform(0.75, 1.0), rng.uniform(1.98, 2.15)
    canvas.fill(plane.rect(x - 0.07, 0, x + width + 0.07, height + 0.07), taste.trim)
    leaf = colour(rng, (0.35, 0.95))
    canvas.textured(plane.rect(x, 0.01, x + width, height), leaf, "wood", along=1)
    canvas.fill(plane.rect(x, 0.01, x + 0.012, height), 0.4 * leaf)
    for y in np.linspace(0.15, height - 0.12, rng.integers(1, 5))[:-1]:
        step = (height - 0.27) / 3
        for grow, shade in ((0.02, 0.75), (0, 0.95)):
            corners = plane.rect(x + 0.14 - grow, y - grow, x + width - 0.14 + grow, y + step - 0.12 + grow)
            canvas.fill(corners, shade * leaf)
    canvas.fill(plane.rect(x + 0.06, 1.03, x + 0.18, 1.06), np.array([90, 85, 80]))
    return width


def images(canvas: Canvas, plane: Plane, rng, x: float) -> float:
    """An image or poster, some of them hung askew."""
    width, height, y = rng.uniform(0.25, 1.1), rng.uniform(0.25, 1.0), rng.uniform(1.0, 1.5)
    turn = rng.normal(0, 2) if rng.random() < 0.3 else 0.0
    canvas.fill(plane.rect(x, y, x + width, y + height, turn), colour(rng, (0.05, 0.9)))
    inner = plane.rect(x + 0.03, y + 0.03, x + width - 0.03, y + height - 0.03, turn)
    canvas.textured(inner, colour(rng, saturation=0.9), "cloth")
    for _ in range(rng.integers(1, 6)):
        a, b = np.sort(rng.uniform(0.1, 0.9, (2, 2)), axis=0) * [width, height] + [x, y]
        canvas.fill(
            plane.rect(a[0], a[1], b[0], b[1], rng.choice([0, rng.uniform(0, 90)])),
            colour(rng, saturation=0.9),
        )
    return width


def shelf(plane: Plane, normal: np.ndarray, rng, x: float, low: float) -> tuple[list, float]:
    """Boards with books on a wall of normal (3,), as a box whose face carries them."""
    width, rows, step = rng.uniform(0.6, 1.8), int(rng.integers(1, 6)), rng.uniform(0.28, 0.4)
    wood, seed = colour(rng), int(rng.integers(2**31))

    def details(canvas: Canvas, face: Plane, across: float, height: float) -> None:
        if across < 0.4:
            return
        books = np.random.default_rng(seed)
        for row in range(rows):
            base = row * step + 0.02
            canvas.fill(face.rect(0.02, base, across - 0.02, base + step - 0.025), 0.35 * wood)
            at = 0.03
            while at < across - 0.1:
                thick, tall = books.uniform(0.015, 0.06), books.uniform(0.5, 0.9) * step
                lean = books.uniform(-14, 14) if books.random() < 0.12 else 0.0
                canvas.fill(face.rect(at, base, at + thick, base + tall, lean), colour(books, saturation=0.8))
                at += thick + 0.003 + (books.uniform(0.05, 0.5) if books.random() < 0.15 else 0)

    size = np.array([width, 0.26, rows * step])
    at = plane.at(np.array([[x + width / 2, low]]))[0] + 0.13 * normal
    yaw = np.arctan2(plane.right[1], plane.right[0])
    return [standing(at, size, yaw, wood, details)], width


def radiator(plane: Plane, normal: np.ndarray, rng, x: float) -> tuple[list, float]:
    """A radiator on a wall of normal (3,), from x metres on; its width."""
    width, height = rng.uniform(0.5, 1.6), rng.uniform(0.4, 0.7)
    pitch = rng.uniform(0.04, 0.09)

    def ribs(canvas: Canvas, face: Plane, across: float, tall: float) -> None:
        for rib in np.arange(pitch, across - pitch / 2, pitch):
            canvas.fill(face.rect(rib, 0.05, rib + 0.25 * pitch, tall - 0.05), 0.72 * WHITE)

    at = plane.at(np.array([[x + width / 2, 0.12]]))[0] + 0.07 * normal
    yaw = np.arctan2(plane.right[1], plane.right[0])
    return [standing(at, (width, 0.1, height), yaw, WHITE, ribs)], width


def wall(canvas: Canvas, rng, plane: Plane, length: float, height: float, taste: Style) -> list[Box]:
    """Paint a wall with what is flat on it -> what stands out from it, to be painted later."""
    normal = np.cross(plane.up, plane.right)  # into the room: its walls run round it counter-clockwise
    shade = 0.8 + 0.2 * abs(plane.right[0])
    canvas.textured(plane.rect(0, 0, length, height), shade * taste.wall, taste.texture)
    if not len(canvas.seen(plane.rect(0, 0, length, height))):
        return []
    if rng.random() < 0.25 + 0.6 * taste.richness:
        skirting = rng.uniform(0.05, 0.14)
        canvas.fill(plane.rect(0, 0, length, skirting), shade * taste.trim)
        canvas.fill(plane.rect(0, skirting, length, skirting + 0.01), 0.6 * shade * taste.trim)
    out, x = [], rng.uniform(0.1, 0.9)
    while x < length - 1.2:
        kinds, odds = ["door", "window", "picture", "shelf", "radiator", "bare"], [2, 3, 3, 2, 1, 1]
        odds = np.array(odds) * ([1] * 5 + [12 * (1 - taste.richness) ** 2])
        kind = rng.choice(kinds, p=odds / odds.sum())
        width = 1.0
        if kind == "door":
            width = door(canvas, plane, rng, x, taste)
        elif kind == "window":
            width, low = min(rng.uniform(0.7, 2.0), length - x - 0.2), rng.uniform(0.3, 1.0)
            panes(canvas, plane, rng, (x, low, x + width, rng.uniform(1.9, height - 0.2)), taste)
        elif kind == "picture":
            width = images(canvas, plane, rng, x)
        elif kind == "shelf":
            boxes, width = shelf(plane, normal, rng, x, rng.choice([0, 1.2]))
            out += boxes
        elif kind == "radiator":
            boxes, width = radiator(plane, normal, rng, x)
            out += boxes
        if rng.random() < 0.5 * taste.richness:
            canvas.fill(plane.rect(x + width + 0.1, 0.3, x + width + 0.18, 0.38), WHITE)  # a socket
        x += width + rng.uniform(0.12, 1.2) / (0.4 + taste.richness)
    return out


def _timber(canvas: Canvas, plane: Plane, rng, storey: float, across: float, height: float) -> None:
    """The framework of a house with its diagonal braces."""
    dark = colour(rng, (0.15, 0.35), 0.5)
    for base in np.arange(storey, height - storey / 2, storey):
        canvas.fill(plane.rect(0, base - 0.1, across, base + 0.1), dark)
        for x in np.arange(0.3, across - 1, rng.uniform(0.8, 1.6)):
            canvas.fill(plane.rect(x - 0.08, base, x + 0.08, base + storey), dark)
            lean = rng.choice([-1, 0, 1]) * rng.uniform(0.4, 1)
            foot, top = [x, base], [x + lean, base + storey]
            canvas.fill(
                plane.at(np.array([foot, np.add(foot, [0.16, 0]), np.add(top, [0.16, 0]), top])), dark
            )


def front(rng, taste: Style, storey: float, width: float):
    """Details of a house's front for Box: rows of windows, doors and a shop below, ledges, a downpipe."""
    columns, shop = max(1, int(width / rng.uniform(1.8, 3.2))), rng.random() < 0.3
    cladding = rng.choice(["none", "boards", "timber"], p=[0.55, 0.25, 0.2])
    high, wide, seed = rng.uniform(1.1, 1.9), rng.uniform(0.7, 1.3), int(rng.integers(2**31))

    def details(canvas: Canvas, plane: Plane, across: float, height: float) -> None:
        if abs(across - width) > 1e-6 or not len(canvas.seen(plane.rect(0, 0, across, height))):
            return  # a gable, or out of the image
        own = np.random.default_rng(seed)
        step = across / columns
        for y in np.arange(0.6, height, 0.3) if cladding == "boards" else ():
            canvas.fill(plane.rect(0, y, across, y + 0.03), 0.6 * taste.wall)
        if cladding == "timber":
            _timber(canvas, plane, own, storey, across, height)
        for floor in range(int(height / storey)):
            base = floor * storey
            if floor and taste.richness > 0.3:
                canvas.fill(plane.rect(0, base, across, base + 0.12), 0.85 * taste.trim)
            for x in np.arange(step / 2, across, step):
                if own.random() < 0.12:
                    continue
                if floor == 0 and own.random() < 0.25:
                    door(canvas, plane, own, x - 0.45, taste)
                elif floor == 0 and shop:
                    panes(canvas, plane, own, (x - 0.42 * step, 0.5, x + 0.42 * step, 2.5), taste)
                else:
                    low = base + 0.9
                    panes(canvas, plane, own, (x - wide / 2, low, x + wide / 2, low + high), taste)
        canvas.fill(plane.rect(0, height - 0.3, across, height), 0.7 * taste.trim)
        canvas.fill(plane.rect(0.15, 0, 0.25, height), 0.5 * taste.wall)
        if taste.richness > 0.4:
            canvas.fill(plane.rect(0, 0, across, 0.5), 0.6 * taste.wall)

    return details
