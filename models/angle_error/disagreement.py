"""Errors of angles from a lifter whose errors were not measured, by their distance from the built-in lifter's; and how
far off a lifted take's joints are on the whole, by that or by what the built-in lifter says of its own.

Both lifters look at the same keypoints. Where the built-in one is right within its own stated error, the other is wrong
by what they are apart, within that error; so the squares of both add. What both do wrong in the same way is in the
built-in one's own error, which was fitted on lifted takes with truth.

Of 406 lifts of validation people, by keypoints as detectors have them and by ones with 3 and 5 times their noise or
with long gaps, the mean error of the joints of nine in ten is within 40 % of the expected one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, kabsch, norm, rotate, transpose
from ...pipeline.signals.angles import FINE, UNTRUSTED, near
from ...pipeline.signals.filters import breaks
from ..common.residuals import stated_spread
from ..gravity.evidence import TakeUp
from ..gravity.levelling import level
from ..gravity.votes import PersonFrames, take_rotation
from ..rectifier.load import load_rectifier
from .joint_noise import LiftErrors, shipped_noise
from .posture import LOW, lowness
from .take_angles import MAX_SD_DEG, AngleSeries, TakeJoints, growth_of, smoothed, take_angles

_OVER_S = 1.0  # over which two lifters' difference is averaged: they cross where both are wrong alike
_LEAST = 0.5  # of the frames, in which both have to be
# Mean distance of joints, the body rotated onto the truth in each frame, over the lifter's stated spread: median of
# takes of 9 validation people, upright, and with the pelvis less than posture.LOW over the lower ankle, which they
# crawl, crouch or lie for.
_UPRIGHT, _LOWERED = 1.25, 1.6
# Of a take that is expected to be so far off, one in ten is off by over 100 mm, a hand's breadth: it is called
# suspicious, and without that was as good as one that is off by 30.
FAR_OFF_MM = 75.0
_STATURE_M = 1.7  # of poses without a scale
_FEWEST = 10  # frames that both lifters have


def by_disagreement(
    poses: PoseSequence,
    angles: dict[str, AngleSeries],
    second: PoseSequence,
    up: np.ndarray,
    up_error_deg: np.ndarray,
    cutoff_hz: float | None,
) -> dict[str, AngleSeries] | None:
    """The angles with standard deviations, of rates none; None where `second` has less than half of the poses' frames.

    poses: (T rows) in CAMERA; angles: theirs, without errors, of joints through a low-pass at cutoff_hz. second: the
    built-in lifter's of the same person, in CAMERA, with frame numbers of the same video. up: (3,) or (T, 3) in the
    camera and up_error_deg (T,) its error, as the poses were rectified.
    """
    rows = np.searchsorted(second.frame_index, poses.frame_index)
    has_row = rows < len(second)
    has_row &= second.frame_index[np.minimum(rows, len(second) - 1)] == poses.frame_index
    if has_row.mean() < _LEAST:
        return None
    rows = np.where(has_row, rows, 0)
    joints = np.where(has_row[:, None, None], second.joints[rows].astype(np.float64), np.nan)
    spread = np.where(has_row, stated_spread(second)[rows], np.nan)
    R, error_deg = take_rotation(load_rectifier("pcnet"), joints, poses.times, poses.seams)
    levelled = level(
        PersonFrames(joints, R, error_deg, poses.times, poses.seams, spread=spread), TakeUp(up, up_error_deg)
    )
    seams = breaks(poses)
    filtered = joints if cutoff_hz is None else smoothed(joints, poses.times, cutoff_hz, seams)
    lifted = TakeJoints(joints, filtered, levelled.R_camera_from_body)
    beyond = growth_of(lifted, poses.times)
    by_model = take_angles(
        lifted, LiftErrors(levelled.error_deg, levelled.up_error_deg, shipped_noise(), spread, beyond)
    )
    window = max(round(_OVER_S / float(np.median(np.diff(poses.times)))), 1)
    out = dict(angles)
    for name in list(by_model):
        angle, second_angle = angles[name], by_model.pop(name)
        apart = near(angle.value_deg - second_angle.value_deg, 0.0)
        sd = np.hypot(second_angle.sd_deg, np.sqrt(_running_mean(apart**2, window, seams)))
        # Where the second lift is itself too uncertain, so is the difference from it.
        vague = (angle.reason == FINE) & ((sd > MAX_SD_DEG) | (second_angle.reason == UNTRUSTED))
        out[name] = AngleSeries(
            np.where(vague, np.nan, angle.value_deg),
            np.where((angle.reason == FINE) & ~vague, sd, np.nan).astype(np.float32),
            np.where(vague, UNTRUSTED, angle.reason).astype(np.int8),
            np.broadcast_to(np.float32(np.nan), len(sd)),
        )
    return out


def _running_mean(values: np.ndarray, window: int, seams: Sequence[int]) -> np.ndarray:
    """(T,) the mean of the finite values (T,) within the window about each row, of none across a seam."""
    if len(seams):
        return np.concatenate([_running_mean(part, window, ()) for part in np.split(values, seams)])
    fine = np.isfinite(values)
    total, count = (
        np.convolve(each, np.ones(window))[(window - 1) // 2 :][: len(values)]
        for each in (np.where(fine, values, 0.0), fine.astype(float))
    )
    return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)


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
        lift.without_feet.joints[at].astype(np.float64) / implied_stature(lift.joints)
        for lift, at in ((poses, rows), (second, others))
    ]
    both = np.asarray(is_finite(bodies[0]).all(axis=1) & is_finite(bodies[1]).all(axis=1))
    if both.sum() < _FEWEST:
        return float("nan")
    bodies = [body[both] for body in bodies]
    parts = [_rigid_error(*(body[rows] for body in bodies)) for rows in blocks(len(bodies[0]))]
    apart = float(np.concatenate(parts).mean())
    second_error = _by_lifter(second, None)
    return float(np.sqrt(max(apart**2 - second_error**2, second_error**2)))


def _rigid_error(predicted: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(..., T) mean distance of joints (..., T, 17, 3) after the best rotation and shift of every frame, sizes as they
    are."""
    a = truth - truth.mean(axis=-2, keepdims=True)
    b = predicted - predicted.mean(axis=-2, keepdims=True)
    return norm(rotate(kabsch(a, b), b) - a).mean(axis=-1)
