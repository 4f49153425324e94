"""Joint angles of a take, each with a standard deviation and a reason where it cannot be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...pipeline.core.layouts import FEET, FEET_ANKLES, H36M17
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.signals.angles import (
    ANGLES,
    FINE,
    MISSING,
    TOO_SHORT,
    UNDEFINED,
    UNSEEN,
    UNTRUSTED,
    angles,
)
from ...pipeline.signals.filters import CUTOFF_HZ, each_path, lowpass
from ...pipeline.signals.foot_angles import FOOT_ANGLES, foot_angles, toes_completed
from .joint_noise import JointNoise, angle_sd, shipped_noise

MAX_SD_DEG = 30.0  # a stated standard deviation beyond this says nothing about a joint


@dataclass(frozen=True, eq=False)
class AngleSeries:
    """One angle of a take. value_deg, sd_deg: (T,), NaN where reason (T,) int8 (pipeline.signals.angles.REASONS) is
    not 0.
    sd_deg is NaN throughout for joints that no lifter made, and for angles of the feet: their errors are unknown.
    noise_deg: (T,) the part of sd_deg that differs from frame to frame, which rates are smoothed by."""

    value_deg: np.ndarray
    sd_deg: np.ndarray
    reason: np.ndarray
    noise_deg: np.ndarray


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
    feet: np.ndarray | None = None,
    filtered_feet: np.ndarray | None = None,
) -> dict[str, AngleSeries]:
    """Every angle of pipeline.signals.angles.ANGLES, and of pipeline.signals.foot_angles where feet are given.

    joints, filtered: (T, 17, 3) relative to the pelvis, H36M17, any unit, before and after the low-pass; the angles are
    those of the second. Lifted ones in CAMERA axes: their noise is known in depth and across. R_source_from_body:
    (T, 3, 3), NaN where a frame has none. error_deg, up_error_deg: (T,) of the rectification. unseen: (T, 17) joints
    that are missing because nobody saw them. stated: (T,) the lifter's own error, as of `angle_sd`. feet,
    filtered_feet: (T, 6, 3) in the order of FEET, where joints and filtered are.
    """
    turned = np.asarray(is_finite(R_source_from_body).all(axis=1))
    # Angles between segments are the same in any axes, so a frame that cannot be turned keeps them.
    R = np.where(turned[:, None, None], R_source_from_body, np.eye(3))
    body = rotate(transpose(R), filtered)
    values = angles(body)
    unknown = np.full(len(joints), np.nan)
    noise = shipped_noise() if noise is None else noise
    sd = dict.fromkeys(ANGLES, unknown)
    if lifted:
        error_deg = unknown if error_deg is None else error_deg
        up_error_deg = unknown if up_error_deg is None else up_error_deg
        sd = angle_sd(body, R_source_from_body, error_deg, up_error_deg, noise, stated)
    there, left = is_finite(joints), is_finite(filtered)
    hidden = np.zeros(there.shape, dtype=bool) if unseen is None else unseen & ~there
    defined, points = ANGLES, H36M17.joints
    if feet is not None and filtered_feet is not None:
        defined, points = ANGLES | FOOT_ANGLES, (*H36M17.joints, *FEET.joints)
        values |= foot_angles(body, rotate(transpose(R), filtered_feet))
        there = np.concatenate([there, is_finite(toes_completed(feet))], axis=1)
        left = np.concatenate([left, is_finite(toes_completed(filtered_feet))], axis=1)
        hidden = np.concatenate([hidden, hidden[:, H36M17.indices(FEET_ANKLES)]], axis=1)
    out = {}
    for name, angle in defined.items():
        rows = [points.index(joint) for joint in angle.joints]
        own = sd.get(name, unknown)
        error = noise.whole(name, own, values[name])
        seen, kept = there[:, rows].all(axis=1), left[:, rows].all(axis=1)
        level = turned & level_ok if angle.needs_gravity else kept | turned
        undefined = np.isnan(values[name])
        if lifted and name in ANGLES:
            undefined |= np.isnan(error)  # or a step away from here
        vague = error > MAX_SD_DEG
        reason = np.select(
            [hidden[:, rows].any(axis=1), ~seen, ~level, ~kept, undefined, vague],
            [UNSEEN, MISSING, UNTRUSTED, TOO_SHORT, UNDEFINED, UNTRUSTED],
            FINE,
        ).astype(np.int8)
        fine = reason == FINE
        value, whole, own = (np.where(fine, x, np.nan) for x in (values[name], error, own))
        out[name] = AngleSeries(value, whole, reason, own)
    return out


def smoothed(
    joints: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ, seams: Sequence[int] = ()
) -> np.ndarray:
    """(T, J, 3) through the zero-phase low-pass, each joint on its own, as the stage trajectories does."""
    return each_path(partial(lowpass, time_s=time_s, cutoff_hz=cutoff_hz, seams=seams), joints)
