"""How far off a lifted take's joints are on the whole: by what the built-in lifter says of them, or by how far another
lifter's poses are from its own of the same keypoints.

Of 406 lifts of validation people, by keypoints as detectors have them and by ones with 3 and 5 times their noise or
with long gaps, the mean error of the joints of nine in ten is within 40 % of the expected one.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ..common.metrics import rigid_error
from ..common.spread import stated_spread
from .posture import LOW, lowness

# Mean distance of joints, the body rotated onto the truth in each frame, over the lifter's stated spread: median of
# takes of 9 validation people, upright, and with the pelvis less than posture.LOW over the lower ankle, which they
# crawl, crouch or lie for.
_UPRIGHT, _LOWERED = 1.25, 1.6
# Of a take that is expected to be so far off, one in ten is off by over 100 mm, a hand's breadth: it is called
# suspicious, and without that was as good as one that is off by 30.
FAR_OFF_MM = 75.0
_STATURE_M = 1.7  # of poses without a scale
_FEWEST = 10  # frames that both lifters have


def far_off(poses: PoseSequence, rectified: Rectified, second: PoseSequence | None = None) -> Notice | None:
    """That a take's joints are probably far off; None where they are not, or where nothing tells. poses: H36M17, as
    they were rectified. second: the built-in lifter's of the same keypoints, where another made the poses."""
    share = _by_lifter(poses, rectified) if second is None else _by_second(poses, second)
    stature_m = implied_stature(poses.joints) if poses.frame.metric else _STATURE_M
    expected_mm = 1000 * stature_m * share
    return notice("poses-far-off", mm=float(expected_mm)) if expected_mm > FAR_OFF_MM else None


def _by_lifter(poses: PoseSequence, rectified: Rectified | None) -> float:
    """In shares of stature; NaN of a lifter that states no errors."""
    factors = np.full(len(poses), _UPRIGHT)
    if rectified is not None:
        body = rotate(transpose(rectified.R_source_from_body), poses.joints)
        factors[lowness(body) < LOW] = _LOWERED
    errors = factors * stated_spread(poses)
    return float(np.mean(errors[np.isfinite(errors)])) if np.isfinite(errors).any() else float("nan")


def _by_second(poses: PoseSequence, second: PoseSequence) -> float:
    """In shares of stature. The square of what the two are apart is the sum of the squares of what each is off, where
    they err independently; where they err alike, they are off by as much."""
    _, rows, others = np.intersect1d(
        poses.frame_index, second.frame_index, assume_unique=True, return_indices=True
    )
    bodies = [
        of.without_feet.joints[at].astype(np.float64) / implied_stature(of.joints)
        for of, at in ((poses, rows), (second, others))
    ]
    both = np.asarray(is_finite(bodies[0]).all(axis=1) & is_finite(bodies[1]).all(axis=1))
    if both.sum() < _FEWEST:
        return float("nan")
    bodies = [body[both] for body in bodies]
    parts = [rigid_error(*(body[rows] for body in bodies)) for rows in blocks(len(bodies[0]))]
    apart = float(np.concatenate(parts).mean())
    second_error = _by_lifter(second, None)
    return float(np.sqrt(max(apart**2 - second_error**2, second_error**2)))
