"""What is drawn on images: a skeleton's bones, the horizon, and the straight lines by which up was found."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.camera import Camera, Look
from ...pipeline.core.intrinsics import undistorted_image
from ...pipeline.core.layouts import Layout
from ...pipeline.core.rotations import is_finite
from .palette import GREEN, PURPLE, YELLOW, side_colour

# Green runs up; the two level directions and the horizon have colours that nothing else in an image has.
_COLOURS = {0: GREEN, 1: PURPLE, 2: YELLOW}
HORIZON, _UP = (255, 255, 255), GREEN
FIXED = 4  # bits of a pixel's fraction, as OpenCV draws
WORDS = "Green: lines assumed vertical; purple and yellow: lines assumed level, at right angles; white: the horizon."


def drawn(image: np.ndarray, camera: Camera, look: Look) -> np.ndarray:
    """A copy of the frame (H, W, 3) uint8 RGB with its lines, the horizon and an arrow from the image's middle to where
    up leads there."""
    import cv2

    # Paler, so that the lines stand out.
    out = np.ascontiguousarray(undistorted_image(image, camera.intrinsics)) // 2 + 64
    thick = max(1, round(max(image.shape[:2]) / 500))
    for (start, end), along in zip(look.ends, look.runs_along, strict=True):
        if along >= 0:
            cv2.line(out, _pixel(start), _pixel(end), _COLOURS[int(along)], thick, cv2.LINE_AA)
    edge = horizon(camera, look.up)
    if edge is not None:
        cv2.line(out, _pixel(edge[0]), _pixel(edge[1]), HORIZON, thick + 1, cv2.LINE_AA)
    middle, across = np.array(camera.image_size) / 2, look.up[:2]
    length = np.linalg.norm(across)
    along = across / length if length > 1e-6 else 0 * across
    tip = middle + along * min(camera.image_size) * 0.2
    cv2.arrowedLine(out, _pixel(middle), _pixel(tip), _UP, 2 * thick, cv2.LINE_AA, tipLength=0.2)
    return out


def draw_bones(image: np.ndarray, at: np.ndarray, layout: Layout, thick: int, edge: int = 0) -> None:
    """Lines between points (J, 2) in pixels of an RGB image, in the colours of sides, each with a white edge so
    wide."""
    import cv2

    known, pixels = is_finite(at), np.nan_to_num(np.round(at * (1 << FIXED))).astype(int)
    for bone in layout.bones:
        ends = layout.indices(bone)
        if known[ends].all():
            start, end = pixels[ends].tolist()
            if edge:
                cv2.line(image, start, end, HORIZON, thick + 2 * edge, cv2.LINE_AA, FIXED)
            cv2.line(image, start, end, side_colour(*bone), thick, cv2.LINE_AA, FIXED)


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


def _pixel(point: np.ndarray) -> tuple[int, int]:
    x, y = np.round(point).astype(int)
    return int(x), int(y)
