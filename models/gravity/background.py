"""Whether the camera moves, by what stands still in the world: the corners of the background, outside people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ...pipeline.core.camera import TREMBLE, Background

_SIDE = 640  # pixels of the longer side of what is looked at
_CORNERS, _APART = 200, 7  # at most, and pixels between them
_FEWEST = 25  # corners that have to be found again
_BACK = 0.7  # pixels: where a corner that is followed there and back may end
_WINDOW, _LEVELS = (31, 31), 4  # of the pyramid: corners are found again some 80 pixels away
_STILL = 0.5 / _SIDE  # compression, and a tripod on a floor on which somebody walks: up to 0.3 pixels
# Of the corners: most are still before a tripod; of few that are found again nothing is told. Most move as one picture
# where it is the camera that moves: in videos by cameras that move 0.62 of them and more, in the median of their
# glimpses; where a crowd moves before one that stands still, 0.28.
_MOST, _FEW, _ONE_PICTURE = 0.5, 0.2, 0.5
_SAME = 2.0  # pixels: corners that move as one picture does that is shifted, turned and scaled
# Of the image, that lies between those corners: with less, in the median of glimpses, no picture moves. Before a
# plain wall all corners are on a person's clothes and shadow, with up to 0.08 of it; of cameras that move, 0.26.
_SPREAD = 0.14
_ZOOM = 0.05  # a second, of the picture's scale; and in all, of one that grows, or shrinks, most of the time
_DRIFT = 0.5  # of the way: net of it, below which a picture trembles to and fro


@dataclass(frozen=True)
class Shift:
    """How the background moves from one image to another of one camera: the median of its corners, in longer sides of
    the image to the right and down. still: the share of the corners that stay; together: of those that move as one
    picture. spread: the share of the image that lies between the latter. zoom: the logarithm of the growth."""

    right: float
    down: float
    still: float
    together: float
    spread: float
    zoom: float


def shift(first: np.ndarray, second: np.ndarray, boxes: Sequence[np.ndarray]) -> Shift | None:
    """From one image (H, W, 3) uint8 RGB to another of the same size. boxes: of the people in both, each (N, 4) left,
    top, right, bottom in pixels. None where too few corners are found again: a plain wall, a cut, another place."""
    import cv2

    scale = _SIDE / max(first.shape[:2])
    size = (round(first.shape[1] * scale), round(first.shape[0] * scale))
    before, after = (
        cv2.resize(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), size, interpolation=cv2.INTER_AREA)
        for image in (first, second)
    )
    background = np.full(before.shape, 255, np.uint8)
    for left, top, right, bottom in np.concatenate(list(boxes)) * scale:
        background[max(int(top), 0) : max(int(bottom) + 1, 0), max(int(left), 0) : max(int(right) + 1, 0)] = 0
    corners = cv2.goodFeaturesToTrack(before, _CORNERS, 0.01, _APART, mask=background)
    if corners is None or len(corners) < _FEWEST:
        return None
    options: dict[str, Any] = {"winSize": _WINDOW, "maxLevel": _LEVELS}
    there, followed, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, corners.copy(), **options)
    again, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, there, there.copy(), **options)
    fine = (
        (followed[:, 0] > 0) & (returned[:, 0] > 0) & (np.linalg.norm(again - corners, axis=-1)[:, 0] < _BACK)
    )
    if fine.sum() < max(_FEWEST, _FEW * len(corners)):
        return None
    way = (there - corners)[fine, 0] / _SIDE
    picture, together = cv2.estimateAffinePartial2D(
        corners[fine, 0], there[fine, 0], ransacReprojThreshold=_SAME
    )
    zoom = 0.0 if picture is None else float(np.log(np.hypot(*picture[:, 0])))
    right, down = np.median(way, axis=0)
    still = (np.linalg.norm(way, axis=1) < _STILL).mean()
    around = cv2.convexHull(corners[fine, 0][together[:, 0] > 0])
    spread = cv2.contourArea(around) / before.size
    return Shift(float(right), float(down), float(still), float(together.mean()), float(spread), zoom)


def stands(images: Mapping[int, np.ndarray], boxes: Mapping[int, np.ndarray]) -> bool:
    """Whether images {video frame: (H, W, 3) uint8 RGB}, seconds apart, show that a camera stands still. boxes: {video
    frame: those of `shift`}."""
    shifts = [shift(images[a], images[b], [boxes[a], boxes[b]]) for a, b in pairwise(sorted(images))]
    return bool(shifts) and all(each is not None and each.still > _MOST for each in shifts)


@dataclass(frozen=True)
class Glimpse:
    """Two images `apart_s` seconds from each other, the first at `time_s`. onward: from the first image to that of the
    next glimpse, None where the place is not found again there."""

    time_s: float
    apart_s: float
    shift: Shift
    onward: Shift | None = None


def background_of(glimpses: Sequence[Glimpse]) -> Background | None:
    """How the background moves; None where there are too few glimpses of it, its corners move each their own way, or
    they lie close together. glimpses: in order of time."""
    if not glimpses:
        return None
    if np.median([each.shift.still for each in glimpses]) > _MOST:
        return Background("still")
    together, spread = np.median([(each.shift.together, each.shift.spread) for each in glimpses], axis=0)
    if together < _ONE_PICTURE or spread < _SPREAD:
        return None
    apart = np.array([each.apart_s for each in glimpses])
    speeds = np.array([[each.shift.right, each.shift.down] for each in glimpses]) / apart[:, None]
    at = np.array([each.time_s for each in glimpses])
    lasts = np.diff(at, append=at[-1] + apart[-1])
    # Where the place is found again in the next glimpse its way is measured: of a camera that shakes, speeds that last
    # until then add up to many times that.
    steps = lasts[:, None] * speeds
    for row, onward in enumerate(each.onward for each in glimpses):
        if (
            onward is not None
            and max(onward.together, onward.still) >= _ONE_PICTURE
            and onward.spread >= _SPREAD
        ):
            steps[row] = onward.right, onward.down
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    reach = float(np.hypot(*np.ptp(path, axis=0)))
    speed = float(np.median(np.hypot(*speeds.T)))
    zoom = np.array([each.shift.zoom for each in glimpses]) / apart
    way = float(np.hypot(*steps.T).sum())
    grown, changed = abs((lasts * zoom).sum()), np.abs(lasts * zoom).sum()
    if abs(np.median(zoom)) > _ZOOM or grown > max(_ZOOM, _DRIFT * changed):
        return Background("zooming", speed, reach)
    if reach < TREMBLE or (np.hypot(*path[-1]) < _DRIFT * way and reach < 10 * TREMBLE):
        return Background("hand-held", speed, reach)
    return Background("panning", speed, reach)
