"""Errors of angles from a lifter whose errors were not measured, by their distance from the built-in lifter's.

Both lifters look at the same keypoints. Where the built-in one is right within its own stated error, the other is wrong
by what they are apart, within that error; so the squares of both add. What both do wrong in the same way is in the
built-in one's own error, which was fitted on lifted takes with truth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.pose import PoseSequence
from ...pipeline.signals.angles import FINE, UNTRUSTED, near
from ...pipeline.signals.filters import breaks
from ..common.spread import stated_spread
from ..gravity.evidence import TakeUp
from ..gravity.levelling import level
from ..gravity.sampling import take_rotation
from ..gravity.votes import PersonFrames
from ..rectifier.load import load_rectifier
from .joint_noise import shipped_noise
from .take_angles import MAX_SD_DEG, AngleSeries, LiftErrors, TakeJoints, growth_of, smoothed, take_angles

_OVER_S = 1.0  # over which two lifters' difference is averaged: they cross where both are wrong alike
_LEAST = 0.5  # of the frames, in which both have to be


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
    of = TakeJoints(joints, filtered, levelled.R_camera_from_body)
    beyond = growth_of(of, poses.times)
    by_model = take_angles(
        of, LiftErrors(levelled.error_deg, levelled.up_error_deg, shipped_noise(), spread, beyond)
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
