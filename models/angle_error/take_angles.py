"""Joint angles of a take, each with a standard deviation and a reason where it cannot be trusted, and their angular
velocities, smoothed by the stated errors.

Where limbs contradict their keypoints, the stated errors of elbows and knees grow with the residual; where the
detector is unsure of an arm, those of its angles grow as the score falls. Limbs that may be exchanged have no angles.

Putting such limbs back on their rays with their bone lengths was tried and is no gain: with the noisy keypoints of the
test bed MPJPE, knees and elbows became worse at every threshold, with exact ones they gained 0.1 mm at most.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from ...pipeline.core.conversions import change_frame
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import H36M17, Layout
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite, rotate, transpose
from ...pipeline.signals.angles import (
    ALL_ANGLES,
    ANGLES,
    EXCHANGED,
    FINE,
    FOOT_ANGLES,
    MISSING,
    TOO_SHORT,
    UNDEFINED,
    UNSEEN,
    UNTRUSTED,
    angles,
    foot_angles,
    has_foot_angles,
    near,
    unwrapped,
)
from ...pipeline.signals.filters import CUTOFF_HZ, derivative, each_path, lowpass
from ...pipeline.signals.visibility import SURE_SCORE
from ..common.motion import agrees, steady
from ..common.residuals import LIMBS, Residuals, stated_spread
from ..smoother import known_noise
from .joint_noise import JointNoise, LiftErrors, shipped_noise
from .posture import FEATURES, arms_of, features, growth

MAX_SD_DEG = 30.0  # a stated standard deviation beyond this says nothing about a joint
# Chosen on lifted takes of validation subjects (pcnet3d lab evaluate errors -o DIR).
_ERROR_S = 3.0  # over which an angle's error is forgotten
# Root mean square errors of elbows and knees on lifted validation takes with noisy keypoints are 13 to 14 and 10 to 12
# degrees up to 0.08 statures, 17 and 16 at 0.12, 25 and 20 beyond 0.15: by so much a stature, as squares.
_GROWS_DEG = 120.0
# On the real take (SURE_SCORE) the error of the arms' elevation is 7 degrees (root mean square) where their score is
# 0.6 and more, 9 at 0.5, and 12, 15 and 18 at 0.475, 0.425 and 0.375, while 7 to 8 are stated: by so much a unit of the
# score, as squares. The knees' errors do not grow so.
_UNSURE_DEG = 150.0
_OF_ARMS = (
    "shoulder_elevation",
    "shoulder_flexion",
    "shoulder_abduction",
    "upper_arm_sagittal",
    "elbow_flexion",
)
# An angle of one of these joints rests on the limb. Root mean square errors on lifted validation takes, where the
# detector has exchanged the legs, or the arms: thigh against trunk 9 degrees for 4, shoulder flexion 22 for 8. And
# these about a line between hips or shoulders: the thorax against the pelvis 10 and 16 for 5.
_EXCHANGED = {"leg": ("knee", "heel"), "arm": ("elbow",)}
_ABOUT = {"leg": ("thorax_pelvis_rotation", "pelvis_obliquity"), "arm": ("thorax_pelvis_rotation",)}


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


@dataclass(frozen=True, eq=False)
class TakeJoints:
    """Joints that angles are taken of. joints, filtered: (T, J, 3) relative to the pelvis, any unit, before and after
    the low-pass; the angles are those of the second. R_source_from_body: (T, 3, 3), NaN where a frame has none.
    level_ok: whether up is known. unseen: (T, J) joints that are missing because nobody saw them. layout: H36M17, with
    or without heels and toes behind."""

    joints: np.ndarray
    filtered: np.ndarray
    R_source_from_body: np.ndarray
    level_ok: bool = True
    unseen: np.ndarray | None = None
    layout: Layout = H36M17


def take_angles(take: TakeJoints, errors: LiftErrors | None = None) -> dict[str, AngleSeries]:
    """Every angle of pipeline.signals.angles.ANGLES, and FOOT_ANGLES there where the layout has heels and
    toes. errors: None of joints that no lifter made."""
    turned = np.asarray(is_finite(take.R_source_from_body).all(axis=1))
    # Angles between segments are the same in any axes, so a frame that cannot be turned keeps them.
    R = np.where(turned[:, None, None], take.R_source_from_body, np.eye(3))
    points = rotate(transpose(R), take.filtered)
    body = points[:, : len(H36M17)]
    values = angles(body)
    unknown, sd = np.broadcast_to(np.float32(np.nan), len(body)), {}  # held once
    if errors is not None:
        sd = errors.parts(body, take.R_source_from_body, errors.size(take.filtered))
    visible, filtered = (is_finite(joints) for joints in (take.joints, take.filtered))
    hidden = np.zeros(visible.shape, dtype=bool) if take.unseen is None else take.unseen & ~visible
    defined = ANGLES
    if has_foot_angles(take.layout):
        defined = ANGLES | FOOT_ANGLES
        values |= foot_angles(points, take.layout)
    out = {}
    for name, angle in defined.items():
        parts = take.layout.indices([joint for joint in angle.joints if joint in take.layout])
        whole, own, tilt = unknown, unknown, unknown
        stated = errors if name in sd else None
        if stated is not None:
            own, tilt = sd.pop(name)
            beyond = None if stated.growth is None else stated.growth[arms_of(name)]
            whole = stated.noise.whole(name, own, tilt, values[name], beyond)
        measured, smooth = visible[:, parts].all(axis=1), filtered[:, parts].all(axis=1)
        level = turned & take.level_ok if angle.needs_gravity else smooth | turned
        undefined = np.isnan(values[name])
        if stated is not None:
            undefined |= np.isnan(whole)  # or a step away from here
        vague = whole > MAX_SD_DEG
        reason = np.select(
            [hidden[:, parts].any(axis=1), ~measured, ~level, ~smooth, undefined, vague],
            [UNSEEN, MISSING, UNTRUSTED, TOO_SHORT, UNDEFINED, UNTRUSTED],
            FINE,
        ).astype(np.int8)
        fine = reason == FINE
        value = np.where(fine, values[name], np.nan)
        if stated is not None:
            whole, own, tilt = (np.where(fine, x, np.nan).astype(np.float32) for x in (whole, own, tilt))
        out[name] = AngleSeries(value, whole, reason, own, tilt)
    return out


def growth_of(take: TakeJoints, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """{of posture.arms_of: (T, 4) of posture.growth}, at times (T,)."""
    filtered = take.filtered[:, : len(H36M17)]
    posture = features(rotate(transpose(take.R_source_from_body), filtered), time_s)
    return {arms: growth(posture, arms) for arms in ("arms", "r_arm", "l_arm")}


def angle_series(
    poses: PoseSequence, rectified: Rectified, filtered: PoseSequence, noise: JointNoise | None
) -> tuple[dict[str, AngleSeries], np.ndarray]:
    """`take_angles` of poses that are rectified, and the body's speed (T,) as posture.growth has it, 0 where no errors
    are known. filtered: rectified's LEVEL through the low-pass; noise: of the lifter that made them,
    None where it was not measured.
    """
    source, R_reference_from_source = in_reference(poses)
    R_reference_from_level = R_reference_from_source @ rectified.R_source_from_level
    take = TakeJoints(
        source.joints,
        rotate(R_reference_from_level.astype(np.float32), filtered.joints),
        R_reference_from_source @ rectified.R_source_from_body,
        level_ok=rectified.level_ok,
        unseen=poses.confidence == 0,
        layout=poses.layout,
    )
    errors, speed = None, np.zeros(len(poses))
    if noise is not None:
        beyond = growth_of(take, poses.times)
        speed = beyond["arms"][:, FEATURES.index("speed")]
        errors = LiftErrors(rectified.error_deg, rectified.up_error_deg, noise, stated_spread(source), beyond)
    return take_angles(take, errors), speed


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


def angle_rates(
    series: dict[str, AngleSeries],
    time_s: np.ndarray,
    breaks: Sequence[int] = (),
    noise: JointNoise | None = None,
    speed: np.ndarray | float = 0.0,
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{angle: (rate, standard deviation)}, both (T,) degrees a second, NaN where the angle is.

    series: of joints through the low-pass, at time_s (T,). An angle with stated errors goes through the smoother that
    knows them (models/smoother.py), as a process that turns on where it passes the end of its range. An
    angle without them has its derivative, whose error is unknown. breaks: rows at which something new begins. noise: of
    the lifter, the shipped one's without; speed: (T,) of `angle_series`.
    """
    stated = [name for name, angle in series.items() if np.isfinite(angle.noise_deg).any()]
    rates = {
        name: (
            derivative(angle.value_deg, time_s, _with_turns(angle.value_deg, breaks)),
            np.full(len(time_s), np.nan),
        )
        for name, angle in series.items()
        if name not in stated
    }
    if not stated:
        return rates
    angles = np.stack([unwrapped(series[name].value_deg) for name in stated], axis=1)
    variance = np.stack([series[name].noise_deg for name in stated], axis=1) ** 2
    motion = known_noise(angles[..., None], time_s, variance[..., None, None], breaks, error_s=_ERROR_S)
    finite = np.isfinite(angles)
    rate = np.where(finite, motion.values[1, ..., 0], np.nan)
    sd = np.where(finite, np.sqrt(motion.variance[1, ..., 0]), np.nan)
    noise = shipped_noise() if noise is None else noise
    return rates | {
        name: (rate[:, i], noise.of_rate(name, sd[:, i], rate[:, i], speed)) for i, name in enumerate(stated)
    }


def _with_turns(angle_deg: np.ndarray, breaks: Sequence[int]) -> tuple[int, ...]:
    """The breaks, and where an angle (T,) steps from one end of its range to the other."""
    step = np.diff(angle_deg)
    around = np.abs(step - near(step, 0.0)) > 1.0
    return tuple(sorted({*breaks, *(np.flatnonzero(around & np.isfinite(step)) + 1).tolist()}))


def widened(
    series: Mapping[str, AngleSeries], residuals: Residuals | None, scores: Mapping[str, np.ndarray]
) -> dict[str, AngleSeries]:
    """The angles (T,), those of elbows and knees with the error that their limb's residual adds, those of arms with
    what an unsure detector adds; a value whose error becomes larger than MAX_SD_DEG is left out. residuals: None where
    they are not known. scores: of residuals.limb_scores."""
    result = dict(series)
    if residuals is not None:
        for limb in LIMBS:
            side, part = limb.split("_")
            name = f"{side}_elbow_flexion" if part == "arm" else f"{side}_knee_flexion"
            excess = np.sqrt(np.fmax(steady(residuals.limb(limb)) ** 2 - agrees(residuals) ** 2, 0.0))
            if name in result and excess.any():
                result[name] = _widened(result[name], _GROWS_DEG * excess)
    for limb, score in scores.items():
        lacks = np.fmax(SURE_SCORE - score.min(axis=1), 0.0)
        if limb.endswith("arm") and lacks.any():
            for name in (f"{limb[0]}_{angle}" for angle in _OF_ARMS):
                result[name] = _widened(result[name], _UNSURE_DEG * lacks)
    return result


def without_exchanged(
    series: Mapping[str, AngleSeries], doubt: Mapping[str, np.ndarray]
) -> dict[str, AngleSeries]:
    """The angles (T,), none where they rest on limbs that may be exchanged. doubt: of common/motion.in_doubt."""
    result = dict(series)
    for limb, rows in doubt.items():
        for name in series:
            rests = any(joint.endswith(_EXCHANGED[limb]) for joint in ALL_ANGLES[name].joints)
            if rests or name in _ABOUT[limb]:
                result[name] = _widened(result[name], np.where(rows, np.inf, 0.0), EXCHANGED)
    return result


def _widened(angle: AngleSeries, more_deg: np.ndarray, why: int = UNTRUSTED) -> AngleSeries:
    sd = np.hypot(angle.sd_deg, more_deg)
    lost = sd > MAX_SD_DEG
    return replace(
        angle,
        value_deg=np.where(lost, np.nan, angle.value_deg),
        sd_deg=np.where(lost, np.nan, sd),
        noise_deg=np.where(lost, np.nan, np.hypot(angle.noise_deg, more_deg)),
        reason=np.where(lost & (angle.reason == FINE), why, angle.reason).astype(np.int8),
    )
