"""What is drawn on images: a skeleton's bones, and the horizon."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...pipeline.core.camera import Camera
from ...pipeline.core.layouts import Layout
from ...pipeline.core.rotations import is_finite
from .palette import side_colour

WHITE = (255, 255, 255)  # of the horizon, and around bones
FIXED = 4  # bits of a pixel's fraction, as OpenCV draws


def draw_bones(image: np.ndarray, at: np.ndarray, layout: Layout, thick: int, edge: int = 0) -> None:
    """Lines between points (J, 2) in pixels of an RGB image, in the colours of sides, each with a white edge so
    wide."""
    import cv2

    known = is_finite(at)
    for bone in layout.bones:
        ends = layout.indices(bone)
        if known[ends].all():
            start, end = fixed(at[ends])
            if edge:
                cv2.line(image, start, end, WHITE, thick + 2 * edge, cv2.LINE_AA, FIXED)
            cv2.line(image, start, end, side_colour(*bone), thick, cv2.LINE_AA, FIXED)


def fixed(at: Sequence[float] | np.ndarray) -> list[Any]:
    """Pixels (..., 2) as OpenCV draws with FIXED."""
    return np.round(np.asarray(at) * (1 << FIXED)).astype(int).tolist()


def horizon(camera: Camera, up: np.ndarray) -> np.ndarray | None:
    """(2, 2) pixels where the horizon of up (3,), in CAMERA axes, enters and leaves the image; None when it lies
    outside."""
    width, height = camera.image_size
    x, y, z = up * (1, 1, camera.focal_px)  # a x + b y + c = 0 from the image's middle
    places = []
    for side in (-width / 2, width / 2):
        if abs(y) > 1e-9 and abs(at := -(x * side + z) / y) <= height / 2:
            places.append((side, at))
    for side in (-height / 2, height / 2):
        if abs(x) > 1e-9 and abs(at := -(y * side + z) / x) < width / 2:
            places.append((at, side))
    return np.array(places[:2]) + np.array([width, height]) / 2 if len(places) >= 2 else None
