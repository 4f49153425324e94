"""Joint angles of a take, each with a standard deviation and a reason where it cannot be trusted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.layouts import H36M17
from ...pipeline.motion.angles import (
    ANGLES,
    FINE,
    MISSING,
    TOO_SHORT,
    UNDEFINED,
    UNSEEN,
    UNTRUSTED,
    angles,
)
from ...pipeline.motion.signals import CUTOFF_HZ, lowpass
from ...pipeline.rotations import is_finite, rotate, transpose
from .joint_noise import JointNoise, angle_sd

MAX_SD_DEG = 30.0  # a stated standard deviation beyond this says nothing about a joint


@dataclass(frozen=True, eq=False)
class AngleSeries:
    """One angle of a take. value_deg, sd_deg: (T,), NaN where reason (T,) int8 (pipeline.motion.angles.REASONS) is
    not 0.
    sd_deg is NaN throughout for joints that no lifter made: their errors are unknown."""

    value_deg: np.ndarray
    sd_deg: np.ndarray
    reason: np.ndarray


def take_angles(
    joints: np.ndarray,
    filtered: np.ndarray,
    R_source_from_body: np.ndarray,
    *,
    level_ok: bool = True,
    lifted: bool = True,
    error_deg: np.ndarray | None = None,
    up_error_deg: np.ndarray | None = None,
    noise: JointNoise | None = None,
    unseen: np.ndarray | None = None,
    stated: np.ndarray | None = None,
) -> dict[str, AngleSeries]:
    """Every angle of pipeline.motion.angles.ANGLES.

    joints, filtered: (T, 17, 3) relative to the pelvis, H36M17, any unit, before and after the low-pass; the angles are
    those of the second. Lifted ones in CAMERA axes: their noise is known in depth and across. R_source_from_body:
    (T, 3, 3), NaN where a frame has none. error_deg, up_error_deg: (T,) of the rectification. unseen: (T, 17) joints
    that are missing because nobody saw them. stated: (T,) the lifter's own error, as of `angle_sd`.
    """
    turned = np.asarray(is_finite(R_source_from_body).all(axis=1))
    # Angles between segments are the same in any axes, so a frame that cannot be turned keeps them.
    R = np.where(turned[:, None, None], R_source_from_body, np.eye(3))
    body = rotate(transpose(R), filtered)
    values = angles(body)
    unknown = np.full(len(joints), np.nan)
    sd = dict.fromkeys(ANGLES, unknown)
    if lifted:
        error_deg = unknown if error_deg is None else error_deg
        up_error_deg = unknown if up_error_deg is None else up_error_deg
        sd = angle_sd(body, R_source_from_body, error_deg, up_error_deg, noise, stated)
    there, left = is_finite(joints), is_finite(filtered)
    hidden = np.zeros(there.shape, dtype=bool) if unseen is None else unseen & ~there
    out = {}
    for name, angle in ANGLES.items():
        rows = H36M17.indices(angle.joints)
        seen, kept = there[:, rows].all(axis=1), left[:, rows].all(axis=1)
        level = turned & level_ok if angle.needs_gravity else kept | turned
        undefined = np.isnan(values[name]) | (lifted & np.isnan(sd[name]))  # or a step away from here
        vague = sd[name] > MAX_SD_DEG
        reason = np.select(
            [hidden[:, rows].any(axis=1), ~seen, ~level, ~kept, undefined, vague],
            [UNSEEN, MISSING, UNTRUSTED, TOO_SHORT, UNDEFINED, UNTRUSTED],
            FINE,
        ).astype(np.int8)
        fine = reason == FINE
        values_, sd_ = (np.where(fine, x, np.nan) for x in (values[name], sd[name]))
        out[name] = AngleSeries(values_, sd_, reason)
    return out


def smoothed(joints: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ) -> np.ndarray:
    """(T, J, 3) through the zero-phase low-pass, each joint on its own, as the stage trajectories does."""
    paths = [lowpass(joints[:, i], time_s, cutoff_hz) for i in range(joints.shape[1])]
    return np.stack(paths, axis=1)
