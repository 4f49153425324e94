"""Straight line segments of an image, and how well each knows its direction."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.system import cores

_SIDE_PX = 1280  # images are searched at this longer side: finer shows texture, coarser loses edges
_SHORTEST = 0.025  # of the longer side
_MOST = 600  # segments, the longest
# Of the longer side; a segment along the image's border is the border of something that was cut.
_BORDER = 0.006
# Noise of a segment's direction: of its own, and of its ends at the searched size.
_ANGLE_DEG, _ENDS_PX = 0.45, 0.8
_USUAL = 0.05  # of the longer side: a segment that long weighs 1
_WEIGHTS = (0.3, 4.0)


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of one or more images of a size. Lengths are in longer sides of the image, from its middle.

    ends: (N, 2, 2) both ends. middle: (N, 2). direction: (N, 2) unit, of either sign. sd: (N,) radians, the noise of
    the direction. weight: (N,) how many segments of usual length each counts for, over the images. size: (2,) width
    and height in longer sides."""

    ends: np.ndarray
    middle: np.ndarray
    direction: np.ndarray
    sd: np.ndarray
    weight: np.ndarray
    size: np.ndarray
    first: int

    def __len__(self) -> int:
        return len(self.weight)

    def longest(self, most: int) -> Segments:
        """At most so many of them, with the weight of all."""
        if len(self) <= most:
            return self
        rows = np.argsort(-np.linalg.norm(self.ends[:, 1] - self.ends[:, 0], axis=-1))[:most]
        weight = self.weight[rows] * (self.weight.sum() / self.weight[rows].sum())
        return Segments(
            self.ends[rows], self.middle[rows], self.direction[rows], self.sd[rows], weight, self.size, 0
        )


def segments_of(images: Sequence[np.ndarray], boxes: Sequence[np.ndarray] | None = None) -> Segments:
    """images: (H, W, 3) RGB or (H, W) grey, uint8, all of one size. boxes: for each, (N, 4) left, top, right, bottom in
    pixels of people and other things that move; segments whose middle lies in one are left out."""
    height, width = images[0].shape[:2]
    side = max(height, width)
    with ThreadPoolExecutor(min(cores(), len(images))) as threads:  # the detector lets go of the interpreter
        lines_of = list(threads.map(lambda image: _lines(image, side), images))
    by_image = []
    for lines, masked in zip(lines_of, boxes or [np.zeros((0, 4))] * len(images), strict=True):
        middle = lines.mean(axis=1)
        inside = (
            ((middle[:, None] >= masked[None, :, :2]) & (middle[:, None] <= masked[None, :, 2:]))
            .all(-1)
            .any(-1)
        )
        lines = lines[~inside]
        length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=-1)
        by_image.append(lines[np.argsort(-length)[:_MOST]])
    lines = np.concatenate(by_image)
    ends = (lines - np.array([width, height]) / 2) / side
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=-1)
    ends_rad = _ENDS_PX / (length * min(side, _SIDE_PX))
    return Segments(
        ends=ends,
        middle=ends.mean(axis=1),
        direction=along / length[:, None],
        sd=np.hypot(np.radians(_ANGLE_DEG), ends_rad),
        weight=np.clip(length / _USUAL, *_WEIGHTS) / len(images),
        size=np.array([width, height]) / side,
        first=len(by_image[0]),
    )


def _lines(image: np.ndarray, side: int) -> np.ndarray:
    """(N, 2, 2) ends in pixels of the image, of segments long enough and off the border."""
    import cv2

    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) if image.ndim == 3 else image
    scale = min(1.0, _SIDE_PX / side)
    if scale < 1:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    # The detector draws nothing here, and gives (N, 1, 4) in OpenCV 4, (N, 4) in 5.
    answer = cv2.createLineSegmentDetector().detect(np.ascontiguousarray(grey))[0]
    lines = np.zeros((0, 2, 2)) if answer is None else np.asarray(answer, dtype=np.float64).reshape(-1, 2, 2)
    lines = (lines + 0.5) / scale
    length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=-1)
    size = np.array(image.shape[1::-1])
    near = _BORDER * side
    along_border = ((lines < near).all(axis=1) | (lines > size - near).all(axis=1)).any(axis=-1)
    return lines[(length > _SHORTEST * side) & ~along_border]
