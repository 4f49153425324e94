"""Images whose straight lines say nothing about gravity, or nothing true."""

from __future__ import annotations

import cv2
import numpy as np

from .furniture import colour, paint_all, turned
from .plants import leaves, tree
from .shots import Room, angles, taken
from .textures import fractal
from .views import Canvas, Plane, held

GREEN = np.array([85, 125, 55])
Z = np.array([0, 0, 1.0])


def no_lines(kind: str, seed: int) -> Room:
    """An image of one of KINDS; its camera, up and focal length are as true as a room's."""
    paint, background, number = PAINTERS[kind]
    rng = np.random.default_rng([seed, 3, number])
    tilt = angles(rng)
    canvas = Canvas(held(rng, *tilt), background)
    paint(canvas, rng)
    return taken(canvas, tilt, rng, int(rng.integers(2)))


def _grass(canvas: Canvas, rng: np.random.Generator) -> None:
    """A lawn of blades that grow all ways up to a hedge."""
    view = canvas.view
    ground = Plane(np.array([-60, -60, 0.0]), *np.eye(3)[:2])
    _hedge(canvas, rng, 16)
    canvas.textured(ground.rect(0, 0, 120, 120), GREEN * rng.uniform(0.8, 1.3), "grass")
    right = np.array([view.heading[1], -view.heading[0], 0])
    _hedge(canvas, rng, 14)
    depth = np.sort(8 * rng.random(900) ** 0.6 + 0.6)[::-1]
    roots = depth[:, None] * view.heading + (depth * rng.uniform(-0.8, 0.8, 900))[:, None] * right
    blades = rng.uniform(0.02, 0.07, (900, 1)) * (Z + rng.normal(0, 0.8, (900, 3)))
    for root, blade, shade in zip(roots, blades, rng.uniform(0.5, 1.5, 900), strict=True):
        canvas.fill(np.stack([root, root + 0.006 * right, root + blade]), (GREEN * shade).clip(0, 255))


def _hedge(canvas: Canvas, rng: np.random.Generator, away: float) -> None:
    view = canvas.view
    right = np.array([view.heading[1], -view.heading[0], 0])
    for side in np.arange(-away, away + 1, 2.5):
        at = away * view.heading + side * right + rng.uniform(0.3, 0.8) * Z
        leaves(rng, at, np.array([2.2, 2.2, rng.uniform(1.4, 3)]), 0.4, 90, 0.7 * GREEN).paint(canvas)


def _clouds(canvas: Canvas, rng: np.random.Generator) -> None:
    noise = cv2.convertScaleAbs(fractal(int(rng.integers(2**31)), 4, side=64), alpha=25, beta=128)
    canvas.gain = cv2.resize(noise, canvas.gain.shape[::-1], interpolation=cv2.INTER_CUBIC)


def _trunks(canvas: Canvas, rng: np.random.Generator) -> None:
    """A wood whose trees lean all ways."""
    view = canvas.view
    _hedge(canvas, rng, 15)
    ground = Plane(np.array([-60, -60, 0.0]), *np.eye(3)[:2])
    canvas.textured(ground.rect(0, 0, 120, 120), 0.6 * GREEN, "grass")
    _hedge(canvas, rng, 13)
    right = np.array([view.heading[1], -view.heading[0], 0])
    places = [(rng.uniform(2.5, 12), rng.uniform(-0.7, 0.7)) for _ in range(rng.integers(8, 20))]
    paint_all(canvas, [tree(rng, d * (view.heading + s * right), rng.uniform(4, 12), rng.uniform(0.1, 0.9))
                       for d, s in places])  # fmt: skip


def _black(canvas: Canvas, rng: np.random.Generator) -> None:
    """Nothing but what the sensor adds: the lens cap is on."""


def _facing(canvas: Canvas, rng: np.random.Generator, turn_deg: float) -> Plane:
    """An upright plane without an end before the camera, in which its axes are turned from level and upright."""
    view = canvas.view
    heading = turned(rng.uniform(-0.35, 0.35)).T @ view.heading
    right = np.array([heading[1], -heading[0], 0])
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    x, y = c * right + s * Z, c * Z - s * right
    return Plane(rng.uniform(2, 4) * view.heading + view.position - 15 * (x + y), x, y)


def _stripes(canvas: Canvas, rng: np.random.Generator, plane: Plane, upright: bool) -> None:
    at, paints = 0.0, [colour(rng, saturation=0.7) for _ in range(3)]
    while at < 30:
        wide = rng.uniform(0.03, 0.3)
        corners = plane.rect(at, 0, at + wide, 30) if upright else plane.rect(0, at, 30, at + wide)
        canvas.fill(corners, paints[rng.integers(3)])
        at += wide + rng.uniform(0.05, 0.4)


def _one_direction(canvas: Canvas, rng: np.random.Generator) -> None:
    plane = _facing(canvas, rng, 0)
    canvas.textured(plane.rect(0, 0, 30, 30), colour(rng, (0.5, 0.9)), "plaster")
    _stripes(canvas, rng, plane, upright=False)


def _diagonal(canvas: Canvas, rng: np.random.Generator) -> None:
    plane = _facing(canvas, rng, rng.choice([-1, 1]) * rng.uniform(20, 40))
    canvas.textured(plane.rect(0, 0, 30, 30), colour(rng, (0.5, 0.9)), "cloth")
    _stripes(canvas, rng, plane, upright=False)
    _stripes(canvas, rng, plane, upright=True)


DARK, GREY = (40, 55, 30), (140, 142, 145)
PAINTERS = {  # each with its background and its number among seeds
    "grass": (_grass, DARK, 0), "clouds": (_clouds, GREY, 2), "leaning trunks": (_trunks, DARK, 3),
    "black": (_black, (0, 0, 0), 5), "one direction": (_one_direction, GREY, 6),
    "diagonal pattern": (_diagonal, GREY, 7),
}  # fmt: skip
KINDS = tuple(PAINTERS)
