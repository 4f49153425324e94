"""Bare arrays of 2D keypoints: rtmlib's `keypoints` and `scores` in an .npz, or any .npy of (frames, K, 2 or 3), or of
several people, (frames, people, K, 2 or 3).

x and y are pixels, or shares of the image's width and height where its size is known; a third number is the score. The
layout is told by the number of joints; of 17 in no order that is said, COCO's is taken unless the bones are those of a
body in Human3.6M's. Rows are frames, whose numbers are not in the file; 0, 0 is a joint that was not found.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17, H36M17, IN_2D
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import Shape, arrays_in, peek, plain_array
from ..pipeline.reading.people import REACH, steps
from .kit.people import COUNTS, People, in_pixels

name = "array2d"
gives = "keypoints"
general = True
reads = (
    "2D keypoints in an .npy of (frames, joints, 2 or 3), or rtmlib's keypoints and scores in an .npz, pixels"
)

_KEYS = ("keypoints", "scores")
_MOST_SCORE = 2.0  # and no third coordinate
_SHARES = 1.5  # of the image; a joint may lie beside it


def sniff(path: Path) -> bool:
    if arrays_in(path):
        return arrays_in(path) >= set(_KEYS) and peek(path, *_shapes(2), key=_KEYS[0]) is not None
    points = peek(path, *_shapes(2, 3))
    return points is not None and are_2d(points)


def are_2d(points: np.ndarray) -> bool:
    """Whether points (..., 2 or 3) are pixels or shares of an image, with scores where there is a third number."""
    places, scores = points[..., :2], points[..., 2:]
    visible = np.isfinite(places).all(axis=-1) & (places != 0).any(axis=-1)
    if not visible.any() or np.abs(scores[visible]).max(initial=0) > _MOST_SCORE:
        return False
    visible_points = places[visible]
    shares = (
        visible_points.min() >= -0.5
        and visible_points.max() <= _SHARES
        and (points.shape[-1] == 2 or scores.min() >= 0)
    )
    return bool(shares or np.ptp(visible_points) > 10 * _MOST_SCORE)


def read(path: Path, image_size: tuple[int, int] | None = None) -> tuple[PoseSequence, ...]:
    """Everybody in the array, joined from frame to frame by nearness.

    image_size: width and height in pixels, for coordinates that are shares of them; a run takes those of its video, or
    of read.image_size. InputError for arrays of another shape, and for shares of an image whose size is not known.
    """
    if arrays_in(path):
        points = plain_array(path, *_shapes(2), key=_KEYS[0])
        scores = plain_array(path, points.shape[:-1], key=_KEYS[1])
        points = np.concatenate([points, scores[..., None]], axis=-1)
    else:
        points = plain_array(path, *_shapes(2, 3))
        if not are_2d(points):
            raise InputError(
                "wrong-content",
                f"{path}: expected x and y in pixels, and scores as a third number, got other coordinates; give 3D "
                "joints with --poses.",
            )
    if points.ndim == 4 and len(points) == 1 and np.median(steps(points[0, ..., :2])) < REACH:
        points = points[0]  # a batch of one video, for people of one frame do not stand in each other's place
    points = points[:, None] if points.ndim == 3 else points
    if np.nanmax(np.abs(points[..., :2])) <= _SHARES:
        points = np.concatenate([in_pixels(points[..., :2], image_size, str(path)), points[..., 2:]], axis=-1)
    sightings = People(str(path))
    for frame, people in enumerate(points):
        for person in people:
            if np.nan_to_num(person[:, :2]).any():
                sightings.add(frame, person[:, :2], person[:, 2] if person.shape[1] == 3 else None)
    everybody = tuple(
        poses.with_(frames_known=False) for poses in sightings.keypoints(layouts=(*IN_2D, H36M17))
    )
    if everybody[0].layout != H36M17:
        return everybody
    return tuple(
        poses.saying(notice("order-by-bones", order=H36M17.name, usual=COCO17.name)) for poses in everybody
    )


def _shapes(*columns: int) -> tuple[Shape, ...]:
    return tuple(
        (*many, count, width)
        for many in (("frames",), ("frames", "people"))
        for count in COUNTS
        for width in columns
    )
