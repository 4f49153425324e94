"""Joint angles of a take, each with a standard deviation and a reason where it cannot be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import partial

import numpy as np

from ...pipeline.core.blocks import blocks
from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import CAMERA, LEVEL, change_frame, require
from ...pipeline.core.layouts import FEET, FEET_ANKLES, H36M17
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.signals.angles import ANGLES, FINE, MISSING, TOO_SHORT, UNDEFINED, UNSEEN, UNTRUSTED, angles
from ...pipeline.signals.filters import CUTOFF_HZ, each_path, lowpass
from ...pipeline.signals.foot_angles import FOOT_ANGLES, foot_angles, toes_completed
from ..common.spread import stated_spread
from .joint_noise import JointNoise, angle_sd, noise_size, shipped_noise

MAX_SD_DEG = 30.0  # a stated standard deviation beyond this says nothing about a joint


@dataclass(frozen=True, eq=False)
class AngleSeries:
    """One angle of a take. value_deg, sd_deg: (T,), NaN where reason (T,) int8 (pipeline.signals.angles.REASONS) is
    not 0.
    sd_deg is NaN throughout for joints that no lifter made, and for angles of the feet: their errors are unknown.
    noise_deg: (T,) the part of sd_deg that differs from frame to frame, which rates are smoothed by. tilt_deg: (T,)
    the part that is of up's error, empty where nobody tells it."""

    value_deg: np.ndarray
    sd_deg: np.ndarray
    reason: np.ndarray
    noise_deg: np.ndarray
    tilt_deg: np.ndarray = field(default_factory=lambda: np.zeros(0))


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
    that are missing because nobody saw them. stated: (T,) the lifter's own error, as of `noise_size`. feet,
    filtered_feet: (T, 6, 3) in the order of FEET, where joints and filtered are.
    """
    noise = shipped_noise() if noise is None else noise
    unknown = np.full(len(joints), np.nan)
    error_deg, up_error_deg = (unknown if one is None else one for one in (error_deg, up_error_deg))
    size = noise_size(filtered, error_deg, up_error_deg, noise, stated) if lifted else None

    def of(rows: slice) -> dict[str, AngleSeries]:
        hidden, toes, filtered_toes = (
            None if one is None else one[rows] for one in (unseen, feet, filtered_feet)
        )
        R = R_source_from_body[rows]
        error = None if size is None else (error_deg[rows], up_error_deg[rows], size[rows])
        return _angles(joints[rows], filtered[rows], R, level_ok, noise, error, hidden, toes, filtered_toes)

    parts = [of(rows) for rows in blocks(len(joints))]
    if len(parts) == 1:
        return parts[0]
    return {name: _joined([part.pop(name) for part in parts]) for name in list(parts[0])}


def _angles(
    joints: np.ndarray,
    filtered: np.ndarray,
    R_source_from_body: np.ndarray,
    level_ok: bool,
    noise: JointNoise,
    error: tuple[np.ndarray, np.ndarray, np.ndarray] | None,
    unseen: np.ndarray | None,
    feet: np.ndarray | None,
    filtered_feet: np.ndarray | None,
) -> dict[str, AngleSeries]:
    """As `take_angles`, of some of its rows. error: error_deg, up_error_deg and noise_size of a lifter's."""
    turned = np.asarray(is_finite(R_source_from_body).all(axis=1))
    # Angles between segments are the same in any axes, so a frame that cannot be turned keeps them.
    R = np.where(turned[:, None, None], R_source_from_body, np.eye(3))
    body = rotate(transpose(R), filtered)
    values = angles(body)
    unknown = np.full(len(joints), np.nan)
    sd = {} if error is None else angle_sd(body, R_source_from_body, *error, noise)
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
        own, tilt = sd.get(name, (unknown, unknown))
        whole = noise.whole(name, own, tilt, values[name])
        seen, kept = there[:, rows].all(axis=1), left[:, rows].all(axis=1)
        level = turned & level_ok if angle.needs_gravity else kept | turned
        undefined = np.isnan(values[name])
        if name in sd:
            undefined |= np.isnan(whole)  # or a step away from here
        vague = whole > MAX_SD_DEG
        reason = np.select(
            [hidden[:, rows].any(axis=1), ~seen, ~level, ~kept, undefined, vague],
            [UNSEEN, MISSING, UNTRUSTED, TOO_SHORT, UNDEFINED, UNTRUSTED],
            FINE,
        ).astype(np.int8)
        fine = reason == FINE
        value = np.where(fine, values[name], np.nan)
        whole, own, tilt = (np.where(fine, x, np.nan).astype(np.float32) for x in (whole, own, tilt))
        out[name] = AngleSeries(value, whole, reason, own, tilt)
    return out


def _joined(parts: Sequence[AngleSeries]) -> AngleSeries:
    """Of a long take, whose errors are held once where nobody knows them."""
    joined = {
        each.name: np.concatenate([getattr(part, each.name) for part in parts])
        for each in fields(AngleSeries)
    }
    unknown = np.broadcast_to(np.float32(np.nan), joined["value_deg"].shape)
    return AngleSeries(
        **{name: unknown if np.isnan(values).all() else values for name, values in joined.items()}
    )


def angle_series(
    poses: PoseSequence, rectified: Rectified, filtered: PoseSequence, noise: JointNoise | None
) -> tuple[dict[str, AngleSeries], np.ndarray]:
    """`take_angles` of poses that are rectified, and their times (T,). filtered: rectified's LEVEL through the low-
    pass; noise: of the lifter that made them, None where it was not measured. InputError for another layout or frame.
    """
    if poses.layout != H36M17:
        raise InputError(
            "wrong-content", f"Angles need joints in layout H36M17, got {poses.layout.name}; use remap first."
        )
    require(filtered.frame, LEVEL, "Angles' filtered joints")
    source, R_reference_from_source = in_reference(poses)
    R_reference_from_level = R_reference_from_source @ rectified.R_source_from_level
    feet = None if filtered.feet is None else rotate(R_reference_from_level, filtered.feet.astype(np.float64))
    series = take_angles(
        source.joints,
        rotate(R_reference_from_level.astype(np.float32), filtered.joints),
        R_reference_from_source @ rectified.R_source_from_body,
        level_ok=rectified.level_ok,
        lifted=noise is not None,
        error_deg=rectified.error_deg,
        up_error_deg=rectified.up_error_deg,
        noise=noise,
        unseen=poses.confidence == 0,
        stated=stated_spread(source),
        feet=source.feet,
        filtered_feet=feet,
    )
    return series, source.times


def in_reference(poses: PoseSequence) -> tuple[PoseSequence, np.ndarray]:
    """The poses in the axes that the noise of lifted joints is known in, the camera's own, and the (3, 3) that turned
    them so."""
    source = change_frame(poses, poses.frame.with_(origin="pelvis"))
    reference = CAMERA if source.frame.family == "camera" else source.frame
    R_reference_from_source = reference.basis @ source.frame.basis.T
    return change_frame(
        source, reference.with_(origin="pelvis", unit=source.frame.unit)
    ), R_reference_from_source


def smoothed(
    joints: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ, seams: Sequence[int] = ()
) -> np.ndarray:
    """(T, J, 3) through the zero-phase low-pass, each joint on its own, as the stage trajectories does."""
    return each_path(partial(lowpass, time_s=time_s, cutoff_hz=cutoff_hz, seams=seams), joints)
