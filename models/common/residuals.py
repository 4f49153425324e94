"""How far poses are off the keypoints of the same images, limb by limb, of which limbs a detector is unsure, and how
sure a lifter says it is of a frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.camera import Camera
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.layouts import ARM, H36M17, LEG
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.take import Take
from ...pipeline.signals.reprojection import JOINTS, keypoint_rays, off_rays
from ...pipeline.signals.visibility import SURE_SCORE, mean_scores

# {limb: its joints from the trunk outwards}
LIMBS = {
    f"{side}_{limb}": tuple(f"{side}_{part}" for part in parts)
    for limb, parts in {"arm": ARM, "leg": LEG}.items()
    for side in "rl"
}


@dataclass(frozen=True, eq=False)
class Residuals:
    """How far poses are off their keypoints, in the rows of the poses. NaN where a joint has no visible keypoint, where
    the pose lacks it, and where the body has too few joints to be placed.

    statures: (T, 17, 2) of H36M17, from the keypoint to the joint's image, x right and y down, at the joint's distance
    from the camera, in shares of the person's stature.
    """

    statures: np.ndarray

    def whole(self) -> np.ndarray:
        """(T,) root mean square over JOINTS, in statures; NaN where none is known."""
        square = (self.statures[:, H36M17.indices(JOINTS)] ** 2).sum(axis=-1)
        count = np.isfinite(square).sum(axis=-1)
        return np.sqrt(np.where(count, np.nansum(square, axis=-1), np.nan) / np.maximum(count, 1))

    def limb(self, limb: str) -> np.ndarray:
        """(T,) root mean square of the two outer joints of one of LIMBS, each less that of the joint nearer the trunk:
        how far its bones are off, wherever the body is. In statures; NaN where a bone is not known."""
        bones = np.diff(self.statures[:, H36M17.indices(LIMBS[limb])], axis=1)
        return np.sqrt((bones**2).sum(axis=-1).mean(axis=-1))


@lru_cache(maxsize=1)  # several stages ask about the same take
def residuals(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> Residuals:
    """How far poses are off the keypoints of the same person, each frame placed by itself (`placed`), so that neither
    the body's place nor its size is part of it.

    poses: H36M17 in CAMERA axes, relative to the pelvis, with times, in any unit. keypoints: pixels as they were
    filmed, in any layout that has H36M17's joints; rows belong together by their frame numbers. InputError for poses
    without times.
    """
    rays, trust = keypoint_rays(poses, keypoints, camera)
    joints = poses.without_feet.joints
    stature = implied_stature(joints)
    joints = joints / stature if stature > 0 else np.full_like(joints, np.nan)
    places_body = np.isin(H36M17.joints, JOINTS)
    return Residuals(off_rays(rays.astype(np.float64), joints.astype(np.float64), trust * places_body))


def residuals_of(take: Take) -> Residuals | None:
    """Of a take whose poses are in CAMERA axes; None where it has no keypoints, no camera or other axes."""
    poses, keypoints, camera = take.poses, take.keypoints, take.camera
    if poses is None or keypoints is None or camera is None:
        return None
    if (poses.frame.family, poses.frame.axes) != (CAMERA.family, CAMERA.axes) or not poses.layout.is_body:
        return None
    return residuals(poses, keypoints, camera)


def limb_scores(take: Take) -> dict[str, np.ndarray]:
    """{limb: (T, 2)} of LIMBS in the rows of the poses: mean_scores of its middle and outer joint, one below SURE_SCORE
    where the detector is unsure of the limb. Empty if scores are not known, and for motion capture, which needs no
    detector.
    """
    poses, keypoints = take.poses, take.keypoints
    if poses is None or keypoints is None or poses.made_by.kind == "measured":
        return {}
    scores = mean_scores(keypoints, poses.frame_index, poses.times)
    if scores is None:
        return {}
    return {limb: scores[:, H36M17.indices(joints[1:])] for limb, joints in LIMBS.items()}


def unsure_joints(take: Take) -> dict[str, np.ndarray]:
    """{joint: (T,)} of the middle and outer joints of LIMBS, in the rows of the poses: where the detector is unsure of
    it, and may have guessed. Empty if scores are not known."""
    return {
        joint: score < SURE_SCORE
        for limb, scores in limb_scores(take).items()
        for joint, score in zip(LIMBS[limb][1:], scores.T, strict=True)
    }


def stated_spread(poses: PoseSequence) -> np.ndarray:
    """(T,) geometric mean of the joints' stated standard deviations over axes and joints, as a share of stature; NaN
    where nobody states them. poses: H36M17; the pelvis, from which the others are counted, is left out."""
    poses = poses.without_feet
    if poses.covariance is None:
        return np.full(len(poses), np.nan)
    others = [joint != "pelvis" for joint in poses.layout.joints]
    log_volume = np.zeros(len(poses))
    for rows in blocks(len(poses)):  # in double precision a long take's covariances are a gigabyte
        with np.errstate(invalid="ignore"):  # of missing joints
            log_volume[rows] = np.linalg.slogdet(poses.covariance[rows, others].astype(np.float64))[1].mean(
                axis=1
            )
    return np.exp(log_volume / 6) / implied_stature(poses.joints)
