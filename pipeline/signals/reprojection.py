"""Poses against the keypoints of the same images: where the body has to be for its joints to lie on the rays of its
keypoints, and how far each joint is off them then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.blocks import blocks
from ..core.camera import Camera
from ..core.frames import CAMERA, require
from ..core.intrinsics import undistorted
from ..core.layouts import H36M17, remap
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..core.take import Take
from .visibility import SURE_SCORE, mean_scores, unseen

# Every estimator puts nose, head and spine elsewhere, the detector and the lifter too.
JOINTS = tuple(name for name in H36M17.joints if name not in ("spine", "nose", "head"))
# {limb: its joints from the trunk outwards}
LIMBS = {
    f"{side}_{limb}": tuple(f"{side}_{part}" for part in parts)
    for limb, parts in {"arm": ("shoulder", "elbow", "wrist"), "leg": ("hip", "knee", "ankle")}.items()
    for side in "rl"
}

FEWEST = 6  # joints that place a body
_ROUNDS = 6  # of reweighting; weights change by less than 1 % after five
_ROBUST = 2.0  # times the median residual at which a joint's weight is halved
_LEAST_ERROR = 0.001  # statures, of a joint: exact input is not believed without end
_NEAREST = 0.1  # statures before the camera
_UNKNOWN_CONFIDENCE = 0.7  # as for the lifter


@dataclass(frozen=True, eq=False)
class Residuals:
    """How far poses are off their keypoints, in the rows of the poses. NaN where a joint has no keypoint that was seen,
    where the pose lacks it, and where fewer than FEWEST joints place the body.

    px: (T, 17, 2) of H36M17, from the keypoint to the joint's image, pixels of an ideal lens, x right and y down.
    statures: (T, 17, 2) the same at the joint's distance from the camera, in shares of the person's stature.
    """

    px: np.ndarray
    statures: np.ndarray

    def whole(self) -> np.ndarray:
        """(T,) root mean square over JOINTS, in statures; NaN where none is known."""
        return _rms(self.statures[:, H36M17.indices(JOINTS)])

    def limb(self, limb: str) -> np.ndarray:
        """(T,) root mean square of the two outer joints of one of LIMBS, each less that of the joint nearer the trunk:
        how far its bones are off, wherever the body is. In statures; NaN where a bone is not known."""
        return _limb(self.statures, limb)

    def limb_px(self, limb: str) -> np.ndarray:
        """The same in pixels."""
        return _limb(self.px, limb)


def residuals(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> Residuals:
    """How far poses are off the keypoints of the same person, each frame placed by itself (`placed`), so that neither
    the body's place nor its size is part of it.

    poses: H36M17 in CAMERA axes, relative to the pelvis, with times, in any unit. keypoints: pixels as they were
    filmed, in any layout that has H36M17's joints; rows belong together by their frame numbers. InputError for poses in
    other axes or without times.
    """
    require(poses.frame, CAMERA, "residuals")
    rays, trust = keypoint_rays(poses, keypoints, camera)
    stature = implied_stature(poses.joints)
    joints = poses.joints / stature if stature > 0 else np.full_like(poses.joints, np.nan)
    use = H36M17.indices(JOINTS)
    px, statures = np.empty_like(rays), np.empty_like(rays)
    for rows in blocks(len(joints)):
        place, _ = _placed(
            rays[rows, use].astype(np.float64), joints[rows, use].astype(np.float64), trust[rows, use]
        )
        before = joints[rows] + place[:, None]
        depth = np.where(before[..., 2:] > _NEAREST, before[..., 2:], np.nan)
        off = before[..., :2] / depth - rays[rows]
        px[rows], statures[rows] = off * camera.focal_px, off * depth
    return Residuals(px, statures)


def off_rays(rays: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(T, J, 2) how far joints are off their rays, each row placed by itself, in statures and at their depths; NaN
    where a row has too few. Arguments as of `placed`."""
    place, _ = placed(rays, joints, weights)
    before = joints + place[:, None]
    depth = np.where(before[..., 2:] > _NEAREST, before[..., 2:], np.nan)
    return before[..., :2] - rays * depth


def off_in_image(body: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(N,) how far points body (N, J, 2) are from those that were seen, over the spread of these, when each row's are
    moved and scaled onto them: 0 for the same pose, 1 for none; NaN where fewer than FEWEST are in both."""
    both = (is_finite(body) & is_finite(seen))[..., None]
    enough = both.sum(axis=(1, 2)) >= FEWEST
    off = np.full(len(both), np.nan)
    both = both[enough]
    body, seen = (
        np.where(both, points - np.nanmean(np.where(both, points, np.nan), axis=1, keepdims=True), 0)
        for points in (body[enough], seen[enough])
    )
    spreads = np.linalg.norm(body, axis=(1, 2)) * np.linalg.norm(seen, axis=(1, 2))
    alike = np.divide((body * seen).sum(axis=(1, 2)), spreads, out=np.zeros(len(body)), where=spreads > 0)
    off[enough] = np.sqrt(1 - np.clip(alike, 0, 1) ** 2)
    return off


def residuals_of(take: Take) -> Residuals | None:
    """Of a take whose poses are in CAMERA axes; None where it has no keypoints, no camera or other axes."""
    beside = _beside(take)
    return None if beside is None else residuals(*beside)


def has_residuals(take: Take) -> bool:
    """Whether `residuals_of` would tell them."""
    return _beside(take) is not None


def limb_scores(take: Take) -> dict[str, np.ndarray]:
    """{limb: (T, 2)} of LIMBS in the rows of the poses: mean_scores of its middle and outer joint, one below SURE_SCORE
    where the detector is unsure of the limb. Empty where nothing tells, and of motion capture, which needs no detector.
    """
    poses, keypoints = take.poses, take.keypoints
    if poses is None or keypoints is None or poses.made_by.kind == "measured":
        return {}
    scores = mean_scores(keypoints, poses.frame_index, poses.times)
    return (
        {limb: scores[:, H36M17.indices(of[1:])] for limb, of in LIMBS.items()} if scores is not None else {}
    )


def unsure_joints(take: Take) -> dict[str, np.ndarray]:
    """{joint: (T,)} of the middle and outer joints of LIMBS, in the rows of the poses: where the detector is unsure of
    it, and may have guessed. Empty where nothing tells."""
    return {
        joint: score < SURE_SCORE
        for limb, scores in limb_scores(take).items()
        for joint, score in zip(LIMBS[limb][1:], scores.T, strict=True)
    }


def _beside(take: Take) -> tuple[PoseSequence, PoseSequence, Camera] | None:
    """Poses in CAMERA axes, keypoints of the same images, and their camera; None where one lacks."""
    poses, keypoints, camera = take.poses, take.keypoints, take.camera
    if poses is None or keypoints is None or camera is None:
        return None
    if (poses.frame.family, poses.frame.axes) != (CAMERA.family, CAMERA.axes) or poses.layout != H36M17:
        return None
    return poses, keypoints, camera


def keypoint_rays(
    poses: PoseSequence, keypoints: PoseSequence, camera: Camera
) -> tuple[np.ndarray, np.ndarray]:
    """Rays (T, 17, 2) of H36M17 in the rows of the poses, x / z and y / z in CAMERA axes, NaN where nobody saw them
    (visibility.unseen), and the relative trust (T, 17) in them. Arguments as of `residuals`."""
    hidden, _ = unseen(keypoints, camera.image_size, poses.frame_index, poses.times)
    if camera.intrinsics is not None:  # afterwards, for the filmed image's border is not the ideal one's
        keypoints = keypoints.with_(joints=undistorted(keypoints.joints, camera.intrinsics))
    seen = remap(keypoints, H36M17)
    rows = np.minimum(np.searchsorted(seen.frame_index, poses.frame_index), len(seen) - 1)
    there = (seen.frame_index[rows] == poses.frame_index)[:, None] & ~hidden
    rays = (seen.joints[rows] - np.array(camera.image_size) / 2) / camera.focal_px
    confidence = seen.confidence[rows]
    trust = np.where(np.isfinite(confidence), confidence, _UNKNOWN_CONFIDENCE) ** 2
    return np.where(there[..., None], rays, np.nan), trust


def placed(rays: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The pelvis (T, 3) from the camera, NaN where fewer than FEWEST joints tell, and its information (T, 3, 3), the
    inverse of the covariance, were the joints' errors independent; zero there.

    rays: (T, J, 2) x / z and y / z of the keypoints, CAMERA axes. joints: (T, J, 3) in statures, CAMERA axes, relative
    to the pelvis. weights: (T, J) relative trust in a joint's keypoint, 0 for none. NaN where missing.

    Least squares of the reprojection, linear in the place: x_j + t_x = u_j (z_j + t_z). A joint's equation is weighted
    by how far off it is at the body (Cauchy), so that outliers and exchanged limbs have little say. The equations are
    multiplied by the reprojected rays, not by the observed ones, whose noise would bring the body nearer.
    """
    place, information = np.empty((len(rays), 3)), np.empty((len(rays), 3, 3))
    for rows in blocks(len(rays)):
        place[rows], information[rows] = _placed(rays[rows], joints[rows], weights[rows])
    return place, information


def _placed(rays: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    seen = is_finite(rays) & is_finite(joints) & (weights > 0)
    enough = seen.sum(axis=1) >= FEWEST
    rays, joints = np.where(seen[..., None], rays, 0.0), np.where(seen[..., None], joints, 0.0)
    trust = np.where(seen, weights, 0.0)
    sides = rays * joints[..., 2:] - joints[..., :2]
    weights, expected = trust, rays
    for _ in range(_ROUNDS):
        matrix, right = _normal(weights, rays, expected, sides)
        matrix[~enough] = np.eye(3)
        place = np.linalg.solve(matrix, right[..., None])[..., 0]
        ahead = joints + place[:, None]
        inside = seen & (ahead[..., 2] > _NEAREST)
        expected = np.where(inside[..., None], ahead[..., :2] / np.maximum(ahead[..., 2:], _NEAREST), rays)
        off = np.linalg.norm(place[:, None, :2] - rays * place[:, None, 2:] - sides, axis=-1)
        usual = _median(off * np.sqrt(trust), seen) + _LEAST_ERROR
        weights = trust / (1 + trust * (off / (_ROBUST * usual[:, None])) ** 2)
    freedom = np.maximum(2 * seen.sum(axis=1) - 3, 1)
    variance = (weights * off**2).sum(axis=1) / freedom + _LEAST_ERROR**2 * trust.max(axis=1)
    enough &= place[:, 2] > _NEAREST
    information = (matrix + matrix.swapaxes(1, 2)) / 2 / np.where(enough, variance, 1.0)[:, None, None]
    return np.where(enough[:, None], place, np.nan), np.where(enough[:, None, None], information, 0.0)


def _normal(
    weights: np.ndarray, rays: np.ndarray, expected: np.ndarray, sides: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 3) and (T, 3): the sums over joints of two equations each, multiplied by the expected rays."""
    weighted = weights[..., None]
    matrix = np.zeros((len(rays), 3, 3))
    matrix[:, 0, 0] = matrix[:, 1, 1] = weights.sum(axis=1)
    matrix[:, :2, 2] = -(weighted * rays).sum(axis=1)
    matrix[:, 2, :2] = -(weighted * expected).sum(axis=1)
    matrix[:, 2, 2] = (weighted * rays * expected).sum(axis=(1, 2))
    across, along = (weighted * sides).sum(axis=1), -(weighted * sides * expected).sum(axis=(1, 2))
    return matrix, np.concatenate([across, along[:, None]], axis=1)


def _median(values: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(T,) median of the seen values of each row (T, J); 0 where none is seen."""
    ordered = np.sort(np.where(seen, values, np.inf), axis=1)
    middle = np.take_along_axis(
        ordered, (seen.sum(axis=1) // 2).clip(max=values.shape[1] - 1)[:, None], axis=1
    )[:, 0]
    return np.where(np.isfinite(middle), middle, 0.0)


def _limb(off: np.ndarray, limb: str) -> np.ndarray:
    points = off[:, H36M17.indices(LIMBS[limb])]
    bones = np.diff(points, axis=1)
    return np.sqrt((bones**2).sum(axis=-1).mean(axis=-1))


def _rms(off: np.ndarray) -> np.ndarray:
    """(T,) of offsets (T, J, 2), over those that are known."""
    square = (off**2).sum(axis=-1)
    count = np.isfinite(square).sum(axis=-1)
    return np.sqrt(np.where(count, np.nansum(square, axis=-1), np.nan) / np.maximum(count, 1))
