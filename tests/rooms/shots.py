"""Images with their truth: the camera, its pose, and the person in view."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .spoilers import lit, paint_person, spoilt, through_lens
from .views import Canvas


@dataclass(frozen=True, eq=False)
class Room:
    """An image and its truth.

    image: (H, W, 3) uint8 RGB. up: (3,) unit vector against gravity in camera axes (x right, y down, z away).
    focal_px: pixels. pitch_deg, roll_deg: as in models/lab/synthetic/cameras.py. boxes: (N, 4) x0 y0 x1 y1 of the
    people, pixels.
    """

    image: np.ndarray
    up: np.ndarray
    focal_px: float
    pitch_deg: float
    roll_deg: float
    boxes: np.ndarray


def angles(rng: np.random.Generator) -> tuple[float, float]:
    """Pitch and roll of a camera, degrees: most look a little down and are nearly level, some are tilted by 25."""
    roll = rng.uniform(-25, 25) if rng.random() < 0.1 else np.clip(rng.normal(0, 4), -10, 10)
    return float(rng.triangular(-10, 8, 35)), float(roll)


def taken(canvas: Canvas, tilt: tuple[float, float], rng: np.random.Generator, people: int) -> Room:
    """What the camera makes of a painted canvas, tilt being its pitch and roll in degrees."""
    view = canvas.view
    canvas.gain = lit(canvas.gain, rng)
    image = through_lens(canvas.image(), view, rng.uniform(-0.05, 0.05))
    boxes = np.array([paint_person(image, view, rng) for _ in range(people)]).reshape(-1, 4)
    boxes = boxes[np.isfinite(boxes).all(axis=1)]
    return Room(spoilt(image, rng), view.up, view.focal_px, *tilt, boxes)
