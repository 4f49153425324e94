"""A video's camera, from its images: focal length and up, at one time or along the way."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from ...pipeline.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera, FocalSource, Look
from .images import TOLD_SPREAD, ImageUp, Unknown, up_from_images
from .lines import tangent

FILE_SPREAD = (
    0.08  # of a focal length that the video file states: the sensor's crop and stabilisation are not told
)
_NO_BOX = np.zeros((0, 4))
Boxes = Mapping[int, np.ndarray]  # frame: (N, 4) left, top, right, bottom in pixels of the people there


def static_camera(
    images: Mapping[int, np.ndarray], boxes: Boxes, told_px: float | None = None, file_px: float | None = None
) -> Camera:
    """Of a camera that stood still. images: {video frame: (H, W, 3) uint8 RGB}, a few of a take. told_px, file_px: a
    focal length that the user, or the video file, states."""
    frames = sorted(images)
    height, width = images[frames[0]].shape[:2]
    focal, spread, source = before((width, height), told_px, file_px)
    answer = up_from_images(
        [images[frame] for frame in frames],
        None if source == "prior" else focal,
        [boxes.get(frame, _NO_BOX) for frame in frames],
        focal_spread=spread,
    )
    return _camera((width, height), answer, frames[0], focal, spread, source)


def moving_camera(
    images: Iterable[tuple[int, np.ndarray]],
    size: tuple[int, int],
    boxes: Boxes,
    told_px: float | None = None,
    file_px: float | None = None,
) -> Camera:
    """Of a camera that pans or is carried, an answer for each image that gives one; the focal length that the first of
    them tells serves the others. images: video frame and (H, W, 3) uint8 RGB. size: their width and height. The others
    are arguments of static_camera."""
    focal, spread, source = before(size, told_px, file_px)
    looks: list[Look] = []
    reasons = ["no frame could be decoded"]
    for frame, image in images:
        known_px = None if source == "prior" else focal
        answer = up_from_images([image], known_px, [boxes.get(frame, _NO_BOX)], focal_spread=spread)
        one = _camera(size, answer, frame, focal, spread, source)
        looks += one.looks
        reasons += [one.reason] if one.reason else []
        if one.focal_source != source:
            focal, spread, source = one.focal_px, one.focal_sd_px / one.focal_px, one.focal_source
    found = Camera(size, focal, focal * spread, source, tuple(looks))
    return found if looks else replace(found, reason=max(set(reasons), key=reasons.count))


def before(
    size: tuple[int, int], told_px: float | None, file_px: float | None
) -> tuple[float, float, FocalSource]:
    """The focal length in pixels before an image is looked at, the spread of its logarithm, and who says so."""
    if told_px is not None:
        return told_px, TOLD_SPREAD, "told"
    if file_px is not None:
        return file_px, FILE_SPREAD, "file"
    return PRIOR_FOCAL * max(size), PRIOR_FOCAL_SPREAD, "prior"


def _camera(
    size: tuple[int, int],
    answer: ImageUp | Unknown,
    frame: int,
    focal: float,
    spread: float,
    source: FocalSource,
) -> Camera:
    if isinstance(answer, Unknown):
        return Camera(size, focal, focal * spread, source, reason=answer.reason)
    plane = tangent(answer.up)
    first = answer.segments.first
    look = Look(
        frame=frame,
        up=answer.up,
        covariance=plane @ answer.covariance @ plane.T,
        failure=answer.failure,
        ends=answer.segments.ends[:first] * max(size) + np.array(size) / 2,
        runs_along=answer.runs_along[:first],
    )
    # Lines that say no more about the focal length than was known before leave it as it was.
    if answer.focal_sd_px / answer.focal_px < 0.8 * spread:
        return Camera(
            size, answer.focal_px, answer.focal_sd_px, "lines" if source == "prior" else source, (look,)
        )
    return Camera(size, focal, focal * spread, source, (look,))
