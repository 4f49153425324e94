"""Up and the focal length of a camera, from the straight lines of what it sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Look
from ...pipeline.core.errors import InputError
from .evidence import doubtful
from .lines import Fit, explained, fits, log_before, segments_of, tangent

TOLD_SPREAD = 0.02  # of a focal length that somebody knows
# Pitch and roll that no number of lines makes surer: distortion, walls out of plumb, a principal point off the
# middle (10 pixels of 640 are 0.9 degrees). What 149 photographs with truth, of two sets, ask for; rendered rooms ask
# for half.
_FLOOR_DEG = (1.05, 0.50)
_FOCAL_SHARE = 2.5  # of the fit's own deviation of the focal length, on the same photographs
_LEAST_GAIN = 60.0
_LEAST_SUPPORT = 15.0  # that a direction has to explain to count
_WIDEST_DEG = 4.0
# Segments of one window are not independent, so what they say counts for less; that of an answer which does without
# its third direction for less still, for it may have taken one direction for another. On 400 rendered rooms.
_NATS, _FLAT_NATS = 12.0, 30.0
# How often an answer of so much gain is quite wrong (more than 5 degrees off), on photographs,
_FAILURES = ((100.0, 0.06), (200.0, 0.03), (np.inf, 0.01))
# and one by two directions only: a pattern on one plane, at any angle, looks like that.
_FLAT_FAILURE = 0.15


@dataclass(frozen=True, eq=False)
class ImageUp:
    """What an image, or several of one camera that stood still, say, with the lines of the first. focal_px and
    focal_sd_px: in pixels of the whole image."""

    look: Look
    focal_px: float
    focal_sd_px: float


@dataclass(frozen=True)
class Unknown:
    """No answer, and why, in words."""

    reason: str


def up_from_images(
    images: Sequence[np.ndarray],
    focal_px: float | None = None,
    boxes: Sequence[np.ndarray] | None = None,
    focal_spread: float = TOLD_SPREAD,
) -> ImageUp | Unknown:
    """Which way is up in images of one camera that stood still, by their straight lines.

    images: (H, W, 3) RGB or (H, W) grey, uint8, of one size, without lens distortion to speak of; a few are enough.
    focal_px, focal_spread: where the focal length is known, and the spread of its logarithm. boxes: for each image,
    (N, 4) left, top, right, bottom in pixels of the people. Raises InputError for images of other types or of several
    sizes."""
    _refuse(images, focal_px)
    height, width = images[0].shape[:2]
    side = max(height, width)
    segments = segments_of(images, boxes)
    focal = (focal_px / side, focal_spread) if focal_px else (PRIOR_FOCAL, PRIOR_FOCAL_SPREAD)
    answers = fits(segments, focal)
    if not answers:
        return Unknown("there are hardly any straight lines")
    best = answers[0]
    if best.gain < _LEAST_GAIN:
        return Unknown("the straight lines do not run along upright walls and level edges")
    support, runs_along = explained(segments, best)
    third, second, _ = np.sort(support)
    failure = max(
        next(rate for most, rate in _FAILURES if best.gain <= most),
        _FLAT_FAILURE if third < _LEAST_SUPPORT else 0.0,
    )
    if second < _LEAST_SUPPORT:
        return Unknown(
            "nearly all straight lines run along one direction, which does not show which way is up"
        )
    if doubtful(best.up, failure) and not any(map(len, boxes or ())):
        return Unknown(
            "the straight lines suggest a pitch that cameras seldom have, and no person in the image confirms it"
        )
    covariance = _covariance(best, answers[1:], _FLAT_NATS if third < 0 else _NATS)
    error = float(np.degrees(np.sqrt(np.trace(covariance))))
    if error > _WIDEST_DEG:
        return Unknown(f"the straight lines tell which way is up only to within {error:.0f} degrees")
    assert best.covariance is not None
    look = Look(
        frame=0,
        up=best.up,
        covariance=tangent(best.up) @ covariance @ tangent(best.up).T,
        failure=failure,
        ends=segments.ends[: segments.first] * side + np.array([width, height]) / 2,
        runs_along=runs_along[: segments.first],
    )
    focal_sd_px = float(_FOCAL_SHARE * best.focal * side * np.sqrt(best.covariance[2, 2]))
    return ImageUp(look, best.focal * side, focal_sd_px)


def _covariance(best: Fit, others: Sequence[Fit], nats: float) -> np.ndarray:
    """(2, 2) of the fit, what no fit knows, and the rivals by how likely they are: by e less for so many nats."""
    assert best.covariance is not None
    covariance = best.covariance[:2, :2] + np.diag(np.radians(_FLOOR_DEG) ** 2)
    for rival in others:
        ahead = best.gain + log_before(best.up) - rival.gain - log_before(rival.up)
        likely = 1 / (1 + np.exp(np.clip(ahead / nats, -50.0, 50.0)))
        apart = tangent(best.up).T @ (rival.up - best.up)
        covariance = covariance + likely * np.outer(apart, apart)
    return covariance


def _refuse(images: Sequence[np.ndarray], focal_px: float | None) -> None:
    fine = all(
        image.dtype == np.uint8 and (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3))
        for image in images
    )
    if not fine or len({image.shape[:2] for image in images}) != 1:
        raise InputError(
            "wrong-content",
            "Expected one image or more of (height, width, 3) RGB or (height, width) grey, uint8, all of one size; got "
            f"{', '.join(f'{image.shape} {image.dtype}' for image in images) or 'none'}.",
        )
    if focal_px is not None and not 0.1 < focal_px / max(images[0].shape[:2]) < 20:
        raise InputError(
            "bad-value", f"Expected a focal length in pixels, near the image's longer side; got {focal_px:g}."
        )
