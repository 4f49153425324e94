"""Up of a camera that pans or is carried, from what its images say now and then and what the bodies say all the
time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...pipeline.camera import Look
from ...pipeline.rotations import angle_deg, unit
from .fusion import IMAGE, image_wins

_LOST_DEG_PER_S = 12.0  # how fast a camera's up may go elsewhere where no image says anything
_OUTLIER_DEG = 4.0  # looks this far from the middle of their neighbours count half
_CONTRADICTION = 3.0  # combined errors, median over the frames


def with_looks(
    up: np.ndarray,
    up_error_deg: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int],
    looks: Sequence[tuple[float, Look]],
) -> tuple[np.ndarray, np.ndarray, dict[str, float], tuple[str, ...]]:
    """The bodies' up (T, 3) and its error (T,) together with the images', at times time_s (T,); no look is carried
    over a seam. looks: each with its time. -> up, error, the shares of information by source, and warnings."""
    image, image_error = np.full(up.shape, np.nan), np.full(len(up), np.inf)
    for start, end in pairwise([0, *seams, len(up)]):
        part = slice(start, end)
        times = time_s[part]
        inside = [(at, look) for at, look in looks if len(times) and times[0] - 0.2 <= at <= times[-1] + 0.2]
        if inside:
            image[part], image_error[part] = _between(inside, times)
    both = np.isfinite(up).all(-1) & np.isfinite(image_error)
    apart = angle_deg(up, image)
    warnings: tuple[str, ...] = ()
    weights = [
        np.where(np.isfinite(up).all(-1), 1 / np.maximum(up_error_deg, 0.1) ** 2, 0.0),
        1 / image_error**2,
    ]
    combined = np.hypot(up_error_deg, image_error)
    if both.any() and np.median(apart[both] / combined[both]) > _CONTRADICTION:
        middle = looks[len(looks) // 2][1]
        loser = 0 if image_wins(middle, unit(np.nanmean(up, axis=0))) else 1
        weights[loser] = np.where(both, 0.0, weights[loser])
        who = "image" if loser == 0 else "skeletons"
        warnings = (
            f"The images' lines and the skeletons contradict each other about up by {np.median(apart[both]):.0f} "
            "degrees; "
            f"the {who} {'is' if loser == 0 else 'are'} believed.",
        )
    total = weights[0] + weights[1]
    sums = weights[0][:, None] * np.nan_to_num(up) + weights[1][:, None] * np.nan_to_num(image)
    fused = np.where((total > 0)[:, None], unit(np.where((total > 0)[:, None], sums, 1.0)), np.nan)
    error = np.sqrt(1 / np.where(total > 0, total, np.nan))
    share = float(np.mean(weights[1][total > 0] / total[total > 0])) if (total > 0).any() else 0.0
    return fused, error, {"frames": 1 - share, IMAGE: share}, warnings


def _between(looks: Sequence[tuple[float, Look]], time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3) the images' up between their times, on a line, and (T,) its error in degrees."""
    at = np.array([time for time, _ in looks])
    ups = np.array([look.up for _, look in looks])
    own = np.array([look.error_deg for _, look in looks])
    unsteady = 1.0
    if len(at) > 2:  # a look that is quite another than its neighbours' middle is taken for less
        near = np.clip(np.arange(len(at))[:, None] + np.arange(-2, 3), 0, len(at) - 1)
        usual = unit(np.median(ups[near], axis=1))
        off = angle_deg(ups, usual)
        trust = 1 / (1 + (off / _OUTLIER_DEG) ** 4)[:, None]
        ups = unit(trust * ups + (1 - trust) * usual)
        unsteady = float(np.median(off))
    up = unit(np.stack([np.interp(time_s, at, ups[:, axis]) for axis in range(3)], axis=-1))
    nearest = np.abs(time_s[:, None] - at).min(axis=1)
    outside = np.maximum(np.maximum(at[0] - time_s, time_s - at[-1]), 0.0)
    gap = float(np.median(np.diff(at))) if len(at) > 1 else 1.0
    wander = unsteady * np.minimum(nearest / max(gap, 1e-3), 1.0) + _LOST_DEG_PER_S * np.maximum(
        nearest - gap, 0.0
    )
    return up, np.sqrt(np.interp(time_s, at, own) ** 2 + wander**2 + (_LOST_DEG_PER_S * outside) ** 2)
