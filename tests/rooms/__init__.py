"""Images whose cameras are known: streets between houses, and what has no lines to tell which way is up by."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from pcnet3d.examples.walker.camera import Camera, aimed

X, Y, Z = np.eye(3)
NO_LINES = ("grass", "clouds", "black", "leaning trunks", "one direction")


@dataclass(frozen=True, eq=False)
class Scene:
    """image: (H, W, 3) uint8 RGB. pitch_deg, roll_deg: of its camera. boxes: (N, 4) x0 y0 x1 y1 of people, pixels."""

    image: np.ndarray
    camera: Camera
    pitch_deg: float
    roll_deg: float
    boxes: np.ndarray


def street(seed: int) -> Scene:
    """A street that runs askew to the view, houses on both sides and at its end, and somebody who leans."""
    rng = np.random.default_rng(seed)
    pitch_deg, roll_deg = rng.uniform(-5, 20), rng.normal(0, 6)
    camera = aimed(1.6 * Z, 0, 0, pitch_deg, roll_deg)
    camera = replace(camera, focal_px=rng.uniform(0.65, 1.1) * camera.width, height=480)
    image = np.full((camera.height, camera.width, 3), (150, 185, 225), np.uint8)
    askew = rng.choice([-1, 1]) * rng.uniform(0.15, 0.5)
    along, left = np.cos(askew) * X + np.sin(askew) * Y, np.cos(askew) * Y - np.sin(askew) * X
    for side in range(-18, 18, 3):
        _front(image, camera, rng, 30 * along + side * left, left)
    for ahead in range(27, -3, -3):
        for away in (-rng.uniform(4, 6), rng.uniform(4, 6)):
            _front(image, camera, rng, ahead * along + away * left, along)
            _rectangle(
                image, camera, ahead * along + 0.5 * away * left, 3 * along, 0.2 * left, (210, 210, 205)
            )
    box = _person(image, rng)
    return Scene(_spoilt(image, rng), camera, pitch_deg, roll_deg, box[None])


def no_lines(kind: str, seed: int) -> np.ndarray:
    """(480, 640, 3) one of NO_LINES, or a "diagonal pattern" on an upright wall, which looks like a tilted camera."""
    rng = np.random.default_rng(seed)
    image = np.full((480, 640, 3), 0 if kind == "black" else 140, np.uint8)
    wall = replace(aimed(1.6 * Z, 0, rng.uniform(-20, 20), rng.uniform(-5, 20), rng.normal(0, 6)), height=480)
    if kind == "grass":
        _blades(image, rng, 2000)
    elif kind == "clouds":
        noise = rng.normal(140, 40, (6, 8, 3)).clip(0, 255).astype(np.uint8)
        image = cv2.resize(noise, (640, 480), interpolation=cv2.INTER_CUBIC)
    elif kind == "leaning trunks":
        for foot in np.column_stack([rng.uniform(0, 640, 15), np.full(15, 480)]):
            _line(image, foot, foot + np.array([rng.uniform(-300, 300), -500]), int(rng.integers(5, 30)), rng)
    elif kind == "one direction":
        _stripes(image, wall, rng, 0.0)
        _blades(image, rng, 40)
    elif kind == "diagonal pattern":
        askew = rng.choice([-1, 1]) * np.radians(rng.uniform(20, 40))
        _stripes(image, wall, rng, askew)
        _stripes(image, wall, rng, askew + np.pi / 2)
        _blades(image, rng, 40)
    return _spoilt(image, rng)


def _rectangle(image: np.ndarray, camera: Camera, corner, across, up, colour) -> None:
    """Paint a rectangle of edges `across` and `up` (3,), metres in the world, if it is before the camera."""
    corners = corner + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ np.stack([across, up])
    if (camera.points(corners)[:, 2] > 0.3).all():
        pixels = np.round(16 * camera.project(corners)).astype(np.int32)
        cv2.fillConvexPoly(image, pixels, tuple(map(float, colour)), cv2.LINE_AA, shift=4)


def _front(image: np.ndarray, camera: Camera, rng: np.random.Generator, at, along) -> None:
    """Three metres of a house's front, of three storeys with a window each."""
    wall, frame = rng.uniform(120, 220, 3), rng.uniform(200, 255, 3)
    _rectangle(image, camera, at, 3 * along, 8.6 * Z, wall)
    for low in (0.9, 3.7, 6.5):
        _rectangle(image, camera, at + 0.8 * along + low * Z, 1.4 * along, 1.6 * Z, frame)
        for pane in (0.9, 1.55):
            _rectangle(
                image, camera, at + pane * along + (low + 0.1) * Z, 0.55 * along, 1.4 * Z, (50, 60, 70)
            )


def _stripes(image: np.ndarray, camera: Camera, rng: np.random.Generator, turn: float) -> None:
    """Stripes over an upright wall, radians off the level."""
    along, across = np.cos(turn) * Y + np.sin(turn) * Z, np.cos(turn) * Z - np.sin(turn) * Y
    for up in np.arange(-8, 8, 0.45) + rng.uniform(-0.1, 0.1, 36):
        low = 4 * X - 12 * along + up * across
        _rectangle(image, camera, low, 24 * along, rng.uniform(0.05, 0.25) * across, rng.uniform(0, 255, 3))


def _blades(image: np.ndarray, rng: np.random.Generator, count: int) -> None:
    """Short lines that run all ways."""
    for foot in rng.uniform((0, 0), (640, 480), (count, 2)):
        _line(image, foot, foot + rng.normal(0, 15, 2), int(rng.integers(1, 4)), rng)


def _person(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Paint somebody, whose limbs run all ways -> (4,) x0 y0 x1 y1 of a box around them."""
    box = np.tile(rng.uniform((100, 200), (400, 260)), 2) + np.array([0, 0, 120, 200])
    for a, b in rng.uniform(box[:2] + 10, box[2:] - 10, (8, 2, 2)):
        _line(image, a, b, 9, rng)
    return box


def _line(image: np.ndarray, a, b, thick: int, rng: np.random.Generator) -> None:
    ends = np.round([a, b]).astype(int).tolist()
    cv2.line(image, *ends, tuple(rng.uniform(20, 200, 3)), thick, cv2.LINE_AA)


def _spoilt(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """With a camera's blur and noise."""
    noisy = cv2.GaussianBlur(image, (0, 0), 0.6) + rng.normal(0, 2, image.shape)
    return noisy.clip(0, 255).astype(np.uint8)
