"""Where limbs contradict their keypoints, the stated errors of elbows and knees grow with the residual; where the
detector is unsure of an arm, those of its angles grow as the score falls. Limbs that may be exchanged have no angles.

Putting such limbs back on their rays with their bone lengths was tried and is no gain: with the noisy keypoints of the
test bed MPJPE, knees and elbows became worse at every threshold, with exact ones they gained 0.1 mm at most.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...pipeline.signals.angles import EXCHANGED, FINE, UNTRUSTED
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ...pipeline.signals.visibility import SURE_SCORE
from ..common.motion import agrees, steady
from ..common.residuals import LIMBS, Residuals
from .take_angles import MAX_SD_DEG, AngleSeries

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
