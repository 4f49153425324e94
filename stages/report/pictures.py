"""Small pictures of the video: the person with the 2D keypoints, and the lines of a whole image."""

from __future__ import annotations

import numpy as np

from ...models.common.residuals import unsure_joints
from ...pipeline.core.layouts import Layout
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.signals.visibility import LEAST_SCORE
from ..drawing.image_lines import draw_bones

# Pixels of the longer side, and quality as JPEG: 60 pictures of the film are half a megabyte; lines can be told apart.
_FILM, _LINES = (280, 55), (720, 82)
_ROOM = 1.35  # around the person, in sizes of the keypoints' box


def keypoints_at(take: Take, frame: int) -> tuple[np.ndarray, Layout]:
    """(J, 2) pixels of the 2D keypoints that were seen in a video frame, and their layout; NaN where there are none: a
    detector puts legs that it does not see somewhere. A point of which it is unsure is not drawn either, but a lift
    rests on it (pipeline/signals/visibility.py)."""
    poses, keypoints = take.need("poses"), take.keypoints
    if keypoints is None:
        return np.full((len(poses.layout), 2), np.nan), poses.layout
    row = np.flatnonzero(keypoints.frame_index == frame)
    if not len(row):
        return np.full((len(keypoints.layout), 2), np.nan), keypoints.layout
    certain = keypoints.without(keypoints.confidence < LEAST_SCORE)
    drawn, at = certain.joints[row[0]].copy(), poses.frame_index == frame
    for joint, unsure in unsure_joints(take).items():
        if joint in keypoints.layout and unsure[at].any():
            drawn[keypoints.layout.index(joint)] = np.nan
    return drawn, keypoints.layout


def jpeg(image: np.ndarray, keypoints: np.ndarray, layout: Layout, around: np.ndarray) -> bytes:
    """A small JPEG with keypoints (J, 2) drawn on it, of what is around the points `around` (N, 2); of all of the image
    (H, W, 3) RGB where there are none."""
    import cv2

    corner, size = _crop(image.shape[1::-1], around[is_finite(around)])
    left, top = corner
    part = np.ascontiguousarray(image[top : top + size[1], left : left + size[0]])
    side, quality = _FILM
    scale = side / max(size)
    shape = (max(round(size[0] * scale), 1), max(round(size[1] * scale), 1))
    small = np.ascontiguousarray(cv2.resize(part, shape, interpolation=cv2.INTER_AREA))
    at = (keypoints + 0.5 - corner) * scale - 0.5
    draw_bones(small, at, layout, 2, edge=1)
    return _encoded(small, quality)


def lines_jpeg(image: np.ndarray) -> bytes:
    """A JPEG of a whole image (H, W, 3) RGB."""
    import cv2

    side, quality = _LINES
    scale = min(side / max(image.shape[:2]), 1.0)
    return _encoded(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), quality)


def _encoded(rgb: np.ndarray, quality: int) -> bytes:
    import cv2

    done, content = cv2.imencode(
        ".jpg", np.ascontiguousarray(rgb[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    assert done
    return content.tobytes()


def _crop(size: tuple[int, int], points: np.ndarray) -> tuple[np.ndarray, tuple[int, int]]:
    """Corner and size of the square around points (N, 2) that lies in an image; all of it without points inside."""
    whole = np.array(size)
    inside = points[((points >= 0) & (points < whole)).all(axis=-1)]
    if len(inside) < 2:
        return np.zeros(2, dtype=int), size
    low, high = inside.min(axis=0), inside.max(axis=0)
    side = np.minimum(np.full(2, max(int(_ROOM * (high - low).max()), 32)), whole)
    corner = np.clip(np.round((low + high - side) / 2), 0, whole - side).astype(int)
    return corner, (int(side[0]), int(side[1]))
