"""Up and the focal length of a camera, from the straight lines of what it sees, in a world that people built.

Many edges are vertical, and many of the others run along two horizontal directions at right angles (Coughlan and Yuille
2003, "Manhattan world"). A hypothesis is a camera (up, focal length, principal point) and the heading of those two
directions; it is scored by how much better it explains the segments' directions than chance does, chance being the
image's own blurred histogram of directions, so that an image full of stripes proves nothing by itself.

Everything is in CAMERA axes (x right, y down, z away); lengths in longer sides of the image, from its middle.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from ...pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Look
from ...pipeline.core.errors import InputError
from ...pipeline.core.rotations import angle_deg, from_columns, norm, unit
from ...pipeline.core.system import cores
from .evidence import doubtful, held

_SIDE_PX = 1280  # images are searched at this longer side: finer shows texture, coarser loses edges
_SHORTEST = 0.025  # of the longer side
_MOST = 600  # segments, the longest
# Of the longer side; a segment along the image's border is the border of something that was cut.
_BORDER = 0.006
# Noise of a segment's direction: of its own, and of its ends at the searched size.
_ANGLE_DEG, _ENDS_PX = 0.45, 0.8
_USUAL = 0.05  # of the longer side: a segment that long weighs 1
_WEIGHTS = (0.3, 4.0)

_CENTRE_SPREAD = 0.007  # of a principal point about the image's middle
_SHARES = np.array([0.25, 0.175, 0.175])  # vertical, and either horizontal direction; the rest is clutter
_BLUR_DEG, _UNIFORM = 10.0, 0.15  # of the histogram that chance is
_WIDEST_DEG, _STEP_DEG = 45.0, 2.0  # the search for up, about the image's own
_HEADINGS = 45  # over 90 degrees: then the two horizontal directions change roles
_FOCALS = np.linspace(-2, 2, 7)  # tried by the search, in spreads of what is known before
_MODES, _SEARCHED_MODES, _POLISHED = 18, 5, 3
_GLANCED, _BLURRED_DEG, _COARSE_FOCALS = 250, 1.0, (-1.2, 0.0, 1.2)
_SEARCHED = 400  # segments that the search looks at; the fit looks at all
_SURE = 0.05  # spread of a focal length that is not searched for
_APART_DEG = 6.0  # two answers nearer than this are one
_TURNS = 12
_DESIGN = 6.0  # segments of one window frame are not independent: the information counts a sixth
TOLD_SPREAD = 0.02  # of a focal length that somebody knows
# Pitch and roll that no number of lines makes surer: distortion, walls out of plumb, a principal point off the
# middle (10 pixels of 640 are 0.9 degrees). What 149 photographs with truth, of two sets, ask for; rendered rooms ask
# for half.
_FLOOR_DEG = (1.05, 0.50)
_FOCAL_SHARE = 2.5  # of the fit's own deviation of the focal length, on the same photographs
_LEAST_GAIN = 60.0
_LEAST_SUPPORT = 15.0  # that a direction has to explain to count
_VAGUE_DEG = 4.0
# Segments of one window are not independent, so what they say counts for less; that of an answer which does without
# its third direction for less still, for it may have taken one direction for another. On 400 rendered rooms.
_NATS, _FLAT_NATS = 12.0, 30.0
# How often an answer of so much gain is quite wrong (more than 5 degrees off), on photographs,
_FAILURES = ((100.0, 0.06), (200.0, 0.03), (np.inf, 0.01))
# and one by two directions only: a pattern on one plane, at any angle, looks like that.
_FLAT_FAILURE = 0.15


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments of one or more images of a size. Lengths are in longer sides of the image, from its middle.

    length: (N,). middle: (N, 2). direction: (N, 2) unit, of either sign. sd: (N,) radians, the noise of the direction.
    weight: (N,) how many segments of usual length each counts for, over the images."""

    length: np.ndarray
    middle: np.ndarray
    direction: np.ndarray
    sd: np.ndarray
    weight: np.ndarray

    def __len__(self) -> int:
        return len(self.weight)

    def longest(self, most: int) -> Segments:
        """At most so many of them, with the weight of all."""
        if len(self) <= most:
            return self
        rows = np.argsort(-self.length)[:most]
        weight = self.weight[rows] * (self.weight.sum() / self.weight[rows].sum())
        return Segments(self.length[rows], self.middle[rows], self.direction[rows], self.sd[rows], weight)


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
        length=length,
        middle=ends.mean(axis=1),
        direction=along / length[:, None],
        sd=np.hypot(np.radians(_ANGLE_DEG), ends_rad),
        weight=np.clip(length / _USUAL, *_WEIGHTS) / len(images),
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


@dataclass(frozen=True)
class Fit:
    """up: (3,) unit. focal: longer sides. centre: (2,) principal point. heading: radians, of `horizontals`. gain:
    weighted log-likelihood over chance. covariance: (6, 6) of pitch-like and roll-like turns of up (radians, about
    `tangent`'s axes), log focal, centre and heading; NaN before the fit is polished."""

    up: np.ndarray
    focal: float
    centre: np.ndarray
    heading: float
    gain: float
    covariance: np.ndarray = field(default_factory=lambda: np.full((6, 6), np.nan))


def tangent(up: np.ndarray) -> np.ndarray:
    """(3, 2) two unit directions across up (3,): the first is where up's end goes when the camera's pitch grows (it
    looks further down), the second when its roll does (the image's content turns counter-clockwise)."""
    right = np.array([1.0, 0.0, 0.0])
    away = np.array([0.0, 0.0, 1.0])
    pitch = np.cross(right, up)
    if np.linalg.norm(pitch) < 1e-3:
        pitch = np.cross(np.array([0.0, -1.0, 0.0]), up)
    roll = np.cross(-away, up)
    roll = roll - (roll @ unit(pitch)) * unit(pitch)
    if np.linalg.norm(roll) < 1e-3:
        roll = np.cross(up, pitch)
    return from_columns(unit(pitch), unit(roll))


def horizontals(up: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """(..., 2, 3) two horizontal directions at right angles, for headings (...,) about up (3,)."""
    side = unit(np.cross(up, np.array([0.0, 0.0, 1.0])) + 1e-9 * np.array([1.0, 0.0, 0.0]))
    ahead = np.cross(up, side)
    c, s = np.cos(heading)[..., None], np.sin(heading)[..., None]
    return np.stack([c * side + s * ahead, c * ahead - s * side], axis=-2)


def fits(segments: Segments, focal: tuple[float, float] = (PRIOR_FOCAL, PRIOR_FOCAL_SPREAD)) -> list[Fit]:
    """The best hypotheses, best first, a few degrees apart at least; empty where there are too few segments.

    focal: what is known before, in longer sides, and the spread of its logarithm."""
    if len(segments) < 8:
        return []
    few = segments.longest(_SEARCHED)
    chance, candidates = _chance(few), []
    coarse, fine = (_COARSE_FOCALS, _FOCALS) if focal[1] > _SURE else ((0.0,), (0.0,))
    ups = _modes(few, chance, focal[0])
    # Vertical lines alone hardly tell one up from another; the level ones do, looked at with a blurred eye first.
    blurred = replace(few.longest(_GLANCED), sd=np.hypot(few.longest(_GLANCED).sd, np.radians(_BLURRED_DEG)))
    glance = _chance(blurred)
    gains = [max(_turned(blurred, glance, up, focal, steps, 30).gain for steps in coarse) for up in ups]
    for row in np.argsort(-np.array(gains))[:_SEARCHED_MODES]:
        best = max(
            (_turned(few, chance, ups[row], focal, steps, _HEADINGS) for steps in fine),
            key=lambda fit: fit.gain,
        )
        candidates.append(best)
    candidates.sort(key=lambda fit: -(fit.gain + log_before(fit.up)))
    chance = _chance(segments)
    polished = [_polished(segments, chance, fit, focal) for fit in candidates[:_POLISHED]]
    polished.sort(key=lambda fit: -(fit.gain + log_before(fit.up)))
    distinct: list[Fit] = []
    for fit in polished:
        if all(angle_deg(fit.up, other.up) > _APART_DEG for other in distinct):
            distinct.append(fit)
    return distinct


def support(segments: Segments, fit: Fit) -> np.ndarray:
    """(3,) by how much the gain falls without each of the directions: the vertical, and two level ones."""
    chance, share = _chance(segments), _likelihood(segments, fit) * _SHARES
    clutter = (1 - _SHARES.sum()) * chance
    whole = share.sum(axis=1) + clutter
    without = np.maximum(whole[:, None] - share, 1e-12) + _SHARES * chance[:, None]
    return np.log(whole[:, None] / without).T @ segments.weight


def _chance(segments: Segments) -> np.ndarray:
    """(N,) density per radian of each segment's direction, by the image's own histogram."""
    angle = np.arctan2(segments.direction[:, 1], segments.direction[:, 0]) % np.pi
    bins = 180
    counts = np.bincount((angle / np.pi * bins).astype(int) % bins, weights=segments.weight, minlength=bins)
    lag = np.minimum(np.arange(bins), bins - np.arange(bins)) * (180 / bins)
    kernel = np.exp(-0.5 * (lag / _BLUR_DEG) ** 2)
    blurred = np.fft.irfft(np.fft.rfft(counts) * np.fft.rfft(kernel / kernel.sum()), bins)
    density = (1 - _UNIFORM) * blurred / counts.sum() * bins / np.pi + _UNIFORM / np.pi
    return density[(angle / np.pi * bins).astype(int) % bins]


def _sine(segments: Segments, direction: np.ndarray, focal: float, centre: np.ndarray) -> np.ndarray:
    """(..., N) sine of the angle between each segment and the image of lines along direction (..., 3) at its middle."""
    middle = segments.middle - centre
    shown = focal * direction[..., None, :2] - middle * direction[..., None, 2:]
    length = np.maximum(norm(shown), 1e-9)
    cross = shown[..., 0] * segments.direction[:, 1] - shown[..., 1] * segments.direction[:, 0]
    return cross / length


def _density(segments: Segments, sine: np.ndarray) -> np.ndarray:
    """Of a segment's direction (..., N) given that it runs along the direction that it misses by that sine."""
    return np.exp(-0.5 * (sine / segments.sd) ** 2) / (np.sqrt(2 * np.pi) * segments.sd)


def _sines(segments: Segments, fit: Fit) -> np.ndarray:
    """(3, N) of each of the hypothesis's directions."""
    axes = np.concatenate([fit.up[None], horizontals(fit.up, np.array(fit.heading))])
    return _sine(segments, axes, fit.focal, fit.centre)


def _likelihood(segments: Segments, fit: Fit) -> np.ndarray:
    """(N, 3) density under each of the hypothesis's directions."""
    return _density(segments, _sines(segments, fit)).T


@cache
def _grid() -> tuple[np.ndarray, np.ndarray]:
    """(N, 3) ups that the search begins with, and (N,) what speaks for each before any line."""
    steps = np.radians(np.arange(-_WIDEST_DEG, _WIDEST_DEG + 0.1, _STEP_DEG))
    x, z = np.meshgrid(steps, steps)
    angle = np.hypot(x, z)
    inside = angle <= np.radians(_WIDEST_DEG)
    ratio = np.divide(np.sin(angle), angle, out=np.ones_like(angle), where=angle > 0)
    ups = np.stack([x * ratio, -np.cos(angle), z * ratio], axis=-1)[inside]
    return ups, log_before(ups)


def _modes(segments: Segments, chance: np.ndarray, focal: float) -> list[np.ndarray]:
    """Ups (3,) at which vertical lines alone explain most, each the best of its neighbourhood."""
    ups, before = _grid()
    gain = np.empty(len(ups))
    for start in range(0, len(ups), 256):
        part = slice(start, start + 256)
        density = _density(segments, _sine(segments, ups[part], focal, np.zeros(2)))
        gain[part] = np.log1p(_SHARES[0] * (density / chance - 1)) @ segments.weight
    gain += before
    chosen: list[np.ndarray] = []
    for row in np.argsort(-gain):
        if (angle_deg(ups[row], np.reshape(chosen, (-1, 3))) > _APART_DEG).all():
            chosen.append(ups[row])
        if len(chosen) == _MODES:
            break
    return chosen


def _turned(
    segments: Segments,
    chance: np.ndarray,
    up: np.ndarray,
    before: tuple[float, float],
    steps: float,
    count: int,
) -> Fit:
    """The best of so many headings for an up and a focal length so many spreads from what is known before."""
    focal = before[0] * np.exp(steps * before[1])
    headings = np.arange(count) * (np.pi / 2 / count)
    both = horizontals(up, headings)
    centre = np.zeros(2)
    level = _density(segments, _sine(segments, both, focal, centre)).sum(axis=1) * _SHARES[1]
    vertical = _density(segments, _sine(segments, up, focal, centre)) * _SHARES[0]
    gains = np.log((vertical + level) / chance + 1 - _SHARES.sum()) @ segments.weight
    best = int(gains.argmax())
    return Fit(up, float(focal), centre, float(headings[best]), float(gains[best] - steps**2 / 2))


def _polished(segments: Segments, chance: np.ndarray, fit: Fit, focal: tuple[float, float]) -> Fit:
    """Iterated least squares over up, focal length, principal point and heading, each segment weighed by how surely it
    runs along one of the directions."""
    middle = np.log(focal[0])
    spread = np.array([np.inf, np.inf, focal[1], _CENTRE_SPREAD, _CENTRE_SPREAD, np.inf])
    prior = 1 / spread**2
    information = np.eye(6)
    for _ in range(_TURNS):
        share = _likelihood(segments, fit) * _SHARES
        trust = share / (share.sum(axis=1, keepdims=True) + (1 - _SHARES.sum()) * chance[:, None])
        weight = (trust * (segments.weight / segments.sd**2)[:, None]).T.ravel()
        residual, step = _sines(segments, fit).ravel(), 1e-5
        moved = [_sines(segments, _moved(fit, step * row)).ravel() for row in np.eye(6)]
        slopes = (np.stack(moved, axis=-1) - residual[:, None]) / step
        information = np.einsum("ni,n,nj->ij", slopes, weight, slopes)
        off = np.array([0, 0, np.log(fit.focal) - middle, *fit.centre, 0])
        gradient = np.einsum("ni,n,n->i", slopes, weight, residual) + _DESIGN * prior * off
        change = -np.linalg.lstsq(information + np.diag(_DESIGN * prior), gradient, rcond=None)[0]
        change = np.clip(change, -0.1, 0.1)
        fit = _moved(fit, change)
        if np.abs(change).max() < 2e-5:
            break
    gain = float(np.log(_likelihood(segments, fit) @ _SHARES / chance + 1 - _SHARES.sum()) @ segments.weight)
    off = np.array([np.log(fit.focal) - middle, *fit.centre])
    gain -= float((off**2 * prior[2:5]).sum() / 2)
    covariance = np.linalg.pinv(information / _DESIGN + np.diag(prior), hermitian=True)
    return replace(fit, gain=gain, covariance=covariance)


def _moved(fit: Fit, change: np.ndarray) -> Fit:
    """A neighbour of a hypothesis: turns of up in radians, log focal, principal point, heading."""
    up = unit(fit.up + tangent(fit.up) @ change[:2])
    return replace(
        fit,
        up=up,
        focal=float(fit.focal * np.exp(change[2])),
        centre=fit.centre + change[3:5],
        heading=fit.heading + change[5],
    )


def log_before(up: np.ndarray) -> np.ndarray:
    """(...) what speaks for an up (..., 3) before any line, on the scale of gains: how cameras are held."""
    return _DESIGN * np.log(held(up) + 1e-9)


@dataclass(frozen=True, eq=False)
class ImageUp:
    """What an image, or several of one camera that stood still, say. focal_px and
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
    third, second, _ = np.sort(support(segments, best))
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
    if error > _VAGUE_DEG:
        return Unknown(f"the straight lines tell which way is up only to within {error:.0f} degrees")
    look = Look(
        frame=0,
        up=best.up,
        covariance=tangent(best.up) @ covariance @ tangent(best.up).T,
        failure=failure,
    )
    focal_sd_px = float(_FOCAL_SHARE * best.focal * side * np.sqrt(best.covariance[2, 2]))
    return ImageUp(look, best.focal * side, focal_sd_px)


def _covariance(best: Fit, others: Sequence[Fit], nats: float) -> np.ndarray:
    """(2, 2) of the fit, what no fit knows, and the rivals by how likely they are: by e less for so many nats."""
    covariance = best.covariance[:2, :2] + np.diag(np.radians(_FLOOR_DEG) ** 2)
    for rival in others:
        ahead = best.gain + log_before(best.up) - rival.gain - log_before(rival.up)
        likely = 1 / (1 + np.exp(np.clip(ahead / nats, -50.0, 50.0)))
        apart = tangent(best.up).T @ (rival.up - best.up)
        covariance = covariance + likely * np.outer(apart, apart)
    return covariance


def _refuse(images: Sequence[np.ndarray], focal_px: float | None) -> None:
    if not images:
        raise InputError("needs-input", "Expected one image or more, got none.")
    for image in images:
        if image.dtype != np.uint8 or image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] != 3):
            raise InputError(
                "wrong-content",
                f"Expected images of (height, width, 3) RGB or (height, width) grey, uint8; got {image.shape} "
                f"{image.dtype}.",
            )
    if len({image.shape[:2] for image in images}) > 1:
        raise InputError(
            "wrong-content", "Expected images of one size; give those of each camera on their own."
        )
    if focal_px is not None and not 0.1 < focal_px / max(images[0].shape[:2]) < 20:
        raise InputError(
            "bad-value", f"Expected a focal length in pixels, near the image's longer side; got {focal_px:g}."
        )
