"""Which joints of a lift nobody saw: out of the image, or not found by the detector for a while.

A lifter answers every joint, seen or not, and detectors put joints that they do not see somewhere near the image's
border with a low score. What rests on such keypoints is a guess, not a measurement.
"""

from __future__ import annotations

import numpy as np

from ..core.conversions import remap
from ..core.layouts import H36M17
from ..core.limits import limit
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, norm
from .filters import stretches

LEAST_SCORE = limit("unseen.score")
SURE_SCORE = limit("unseen.sure-score")  # of MoveNet
_LIMBS = {"ankle": "knee", "knee": "hip", "wrist": "elbow", "elbow": "shoulder"}  # end: beginning


def unseen(
    keypoints: PoseSequence, image_size: tuple[int, int] | None, frame_index: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(T, 17) which joints of H36M17 were not visible at video frames frame_index (T,) and times (T,) in seconds, and
    (T, 17) which of them were outside the image. keypoints: of the same person, pixels; image_size: width and height,
    None if unknown. A frame without a row of keypoints counts as neither. A joint of MoveNet that was not visible is
    visible again once the detector is sure of it, not while it only guesses."""
    body = remap(keypoints, H36M17)
    rows = np.searchsorted(body.frame_index, frame_index)
    has_row = (rows < len(body)) & (body.frame_index[np.minimum(rows, len(body) - 1)] == frame_index)
    rows = np.where(has_row, rows, 0)
    points, score = body.joints[rows], body.confidence[rows]
    out = _out(points, image_size) | _squeezed(points, image_size)
    bad = (out | ~is_finite(points) | (score < LEAST_SCORE)) & has_row[:, None]
    hidden, scores = _mostly(bad, times), mean_scores(keypoints, frame_index, times)
    if scores is not None:
        _until_sure(hidden, scores)
    return hidden, _mostly(out & has_row[:, None], times)


def _until_sure(hidden: np.ndarray, scores: np.ndarray) -> None:
    """Adds to hidden (T, 17) the frames between two in which a joint is hidden, or between one and an end of the take,
    if in none of them the score (T, 17) is that of a visible joint."""
    for joint in np.flatnonzero(hidden.any(axis=0)).tolist():
        mask = hidden[:, joint]
        for first, stop in stretches(mask | ~(scores[:, joint] >= SURE_SCORE)).tolist():
            if len(named := first + np.flatnonzero(mask[first:stop])):
                mask[first if first == 0 else named[0] : stop if stop == len(mask) else named[-1] + 1] = True


def mean_scores(keypoints: PoseSequence, frame_index: np.ndarray, times: np.ndarray) -> np.ndarray | None:
    """(T, 17) scores of H36M17's joints, each the mean over a quarter of a second, to compare with SURE_SCORE; NaN
    where no frame has keypoints. None unless MoveNet found them: other detectors' scores have another meaning.
    Arguments as of `unseen`."""
    if keypoints.made_by.by.partition("@")[0] != "movenet":
        return None
    body = remap(keypoints, H36M17)
    rows = np.minimum(np.searchsorted(body.frame_index, frame_index), len(body) - 1)
    score = body.confidence[rows].astype(np.float64)
    has_score = (body.frame_index[rows] == frame_index)[:, None] & np.isfinite(score)
    with np.errstate(invalid="ignore"):
        window_s = limit("unseen.sure-window")
        return _about(np.where(has_score, score, 0.0), times, window_s) / _about(has_score, times, window_s)


def _out(points: np.ndarray, image_size: tuple[int, int] | None) -> np.ndarray:
    """(...,) of points (..., 2) in pixels, which are at the border of the image, or beyond it."""
    if image_size is None:
        return np.zeros(points.shape[:-1], dtype=bool)
    border_px = limit("unseen.border")
    high = np.array(image_size) - 1 - border_px
    return np.asarray(((points <= border_px) | (points >= high)).any(axis=-1))


def _squeezed(points: np.ndarray, image_size: tuple[int, int] | None) -> np.ndarray:
    """(T, 17) of points (T, 17, 2): the end of a limb that lies at the edge of the image and is shorter than its own
    length, from when it came to the edge until it is well inside again; and what lies at the edge with it."""
    squeezed = np.zeros(points.shape[:-1], dtype=bool)
    if image_size is None:
        return squeezed
    size, well_inside = np.array(image_size, dtype=np.float64), limit("squeezed.inside")
    gap = (np.minimum(points, size - 1 - points) / (limit("squeezed.near") * size)).min(axis=-1)
    trunk = norm(points[:, H36M17.index("thorax")] - points[:, H36M17.index("pelvis")])
    for end, beginning in _LIMBS.items():
        for side in "rl":
            at, begins = H36M17.indices((f"{side}_{end}", f"{side}_{beginning}"))
            with np.errstate(divide="ignore", invalid="ignore"):
                length = norm(points[:, at] - points[:, begins]) / trunk
            inside = length[(gap[:, at] > well_inside) & np.isfinite(length)]
            if len(inside) < limit("squeezed.rows"):
                continue
            edge = gap[:, at] <= 1
            short = edge & (length < limit("squeezed.short") * np.median(inside))
            for first, stop in stretches(gap[:, at] <= well_inside).tolist():
                if short[first:stop].any():
                    squeezed[first + int(edge[first:stop].argmax()) : stop, at] = True
            squeezed[:, begins] |= squeezed[:, at] & (gap[:, begins] <= 1)
    return squeezed


def _mostly(mask: np.ndarray, times: np.ndarray) -> np.ndarray:
    """(T, J) True where most frames within half a window of time on either side are."""
    window_s = limit("unseen.window")
    return _about(mask, times, window_s) > 0.5 * _about(np.ones((len(mask), 1)), times, window_s)


def _about(values: np.ndarray, times: np.ndarray, window_s: float) -> np.ndarray:
    """(T, J) the sum of values (T, J) within half a window of time on either side."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    first = np.searchsorted(times, times - window_s / 2)
    last = np.searchsorted(times, times + window_s / 2, side="right")
    return np.asarray(sums[last] - sums[first])
