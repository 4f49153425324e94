"""Plants, and heaps that are as irregular: leaves turned all ways, trees."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .furniture import Group, Rope, colour
from .views import Canvas


@dataclass(eq=False)
class Leaves:
    """Foliage, a plant or a heap of clothes: patches of all shapes, turned all ways, within an ellipsoid."""

    middle: np.ndarray
    radius: np.ndarray
    leaf: float
    shades: np.ndarray  # (n, 3) one colour each
    seed: int

    def paint(self, canvas: Canvas) -> None:
        rng = np.random.default_rng(self.seed)
        n = len(self.shades)
        ball = rng.normal(size=(n, 3))
        ball *= rng.uniform(0.3, 1, (n, 1)) / np.linalg.norm(ball, axis=1, keepdims=True)
        towards = canvas.view.position - self.middle
        ball = ball[np.argsort(ball @ towards)]
        angle = np.sort(rng.uniform(0, 2 * np.pi, (n, 6)), axis=1)
        size = self.leaf * rng.uniform(0.4, 1.3, (n, 1))
        shape = size[..., None] * np.stack([np.cos(angle), rng.uniform(0.4, 1, (n, 1)) * np.sin(angle)], -1)
        turn = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
        corners = self.middle + (ball * self.radius)[:, None] + shape @ turn[:, :2]
        for patch, shade in zip(corners, self.shades, strict=True):
            canvas.fill(patch, shade)


def leaves(rng: np.random.Generator, middle, radius, leaf: float, n: int, paint: np.ndarray) -> Leaves:
    """n leaves of a colour (3,) within an ellipsoid of middle (3,) and radius (3,)."""
    shades = paint * rng.uniform(0.35, 1.25, (n, 1)) * rng.uniform(0.85, 1.1, (n, 3))
    return Leaves(
        np.asarray(middle, float), np.asarray(radius), leaf, shades.clip(0, 255), int(rng.integers(2**31))
    )


def tree(rng: np.random.Generator, at: np.ndarray, height: float, lean: float) -> Group:
    """At a point (3,): a trunk in bent pieces, radians off the vertical, and a crown."""
    bark, azimuth = colour(rng, (0.15, 0.4)), rng.uniform(0, 2 * np.pi)
    t = np.linspace(0, 1, 9)[:, None]
    direction = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
    bend = np.cumsum(rng.normal(0, 0.012 * height, (9, 3)) * [1, 1, 0], axis=0)
    points = at + t * direction * 0.6 * height + bend - bend[0]
    trunk = [Rope(points[i : i + 2], height * 0.05 * (1 - 0.07 * i), bark * rng.uniform(0.8, 1.2))
             for i in range(8)]  # fmt: skip
    green = np.array([90, 130, 60]) * rng.uniform(0.6, 1.3)
    crown = leaves(rng, points[-1] + [0, 0, 0.15 * height], height * np.array([0.28, 0.28, 0.3]),
                   height * 0.035, 260, green)  # fmt: skip
    return Group([*trunk, crown], layered=True)
