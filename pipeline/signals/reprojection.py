"""Where the body has to be for its joints to lie on the rays of the keypoints of the same images."""

from __future__ import annotations

import numpy as np

from ..core.blocks import blocks
from ..core.camera import Camera
from ..core.conversions import remap
from ..core.intrinsics import undistorted
from ..core.layouts import H36M17
from ..core.limits import limit
from ..core.pose import PoseSequence
from ..core.rotations import is_finite, norm
from .visibility import unseen

# Every estimator puts nose, head and spine elsewhere, the detector and the lifter too.
JOINTS = tuple(name for name in H36M17.joints if name not in ("spine", "nose", "head"))

FEWEST = limit("placing.joints")
NEAREST = limit("placing.nearest")  # statures before the camera
_ROUNDS = 6  # of reweighting; weights change by less than 1 % after five


def off_rays(rays: np.ndarray, joints: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(T, J, 2) how far joints are off their rays, each row placed by itself, in statures and at their depths; NaN
    where a row has too few. Arguments as of `placed`."""
    place, _ = placed(rays, joints, weights)
    before = joints + place[:, None]
    depth = np.where(before[..., 2:] > NEAREST, before[..., 2:], np.nan)
    return before[..., :2] - rays * depth


def keypoint_rays(
    poses: PoseSequence, keypoints: PoseSequence, camera: Camera
) -> tuple[np.ndarray, np.ndarray]:
    """Rays (T, 17, 2) of H36M17 in the rows of the poses, x / z and y / z in CAMERA axes, NaN where nobody saw them
    (visibility.unseen), and the relative trust (T, 17) in them.

    poses: with times; keypoints: of the same person, pixels as they were filmed, in any layout that has H36M17's
    joints. Rows belong together by their frame numbers."""
    hidden, _ = unseen(keypoints, camera.image_size, poses.frame_index, poses.times)
    if camera.intrinsics is not None:  # afterwards, for the filmed image's border is not the ideal one's
        keypoints = keypoints.with_(joints=undistorted(keypoints.joints, camera.intrinsics))
    body = remap(keypoints, H36M17)
    rows = np.minimum(np.searchsorted(body.frame_index, poses.frame_index), len(body) - 1)
    visible = (body.frame_index[rows] == poses.frame_index)[:, None] & ~hidden
    rays = (body.joints[rows] - np.array(camera.image_size) / 2) / camera.focal_px
    confidence = body.confidence[rows]
    trust = np.where(np.isfinite(confidence), confidence, limit("placing.unknown-score")) ** 2
    return np.where(visible[..., None], rays, np.nan), trust


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
    usable = is_finite(rays) & is_finite(joints) & (weights > 0)
    enough = usable.sum(axis=1) >= FEWEST
    rays, joints = np.where(usable[..., None], rays, 0.0), np.where(usable[..., None], joints, 0.0)
    trust = np.where(usable, weights, 0.0)
    sides, equations = rays * joints[..., 2:] - joints[..., :2], _equations(rays)
    weights, expected = trust, rays
    least_error, robust = limit("placing.least-error"), limit("placing.robust")
    for _ in range(_ROUNDS):
        weighed = weights[..., None, None] * _equations(expected)
        matrix, right = (np.einsum("tjea,tje...->ta...", weighed, each) for each in (equations, sides))
        matrix[~enough] = np.eye(3)
        place = np.linalg.solve(matrix, right[..., None])[..., 0]
        ahead = joints + place[:, None]
        inside = usable & (ahead[..., 2] > NEAREST)
        expected = np.where(inside[..., None], ahead[..., :2] / np.maximum(ahead[..., 2:], NEAREST), rays)
        off = norm(place[:, None, :2] - rays * place[:, None, 2:] - sides)
        usual = _median(off * np.sqrt(trust), usable) + least_error
        weights = trust / (1 + trust * (off / (robust * usual[:, None])) ** 2)
    freedom = np.maximum(2 * usable.sum(axis=1) - 3, 1)
    variance = (weights * off**2).sum(axis=1) / freedom + least_error**2 * trust.max(axis=1)
    enough &= place[:, 2] > NEAREST
    information = (matrix + matrix.swapaxes(1, 2)) / 2 / np.where(enough, variance, 1.0)[:, None, None]
    return np.where(enough[:, None], place, np.nan), np.where(enough[:, None, None], information, 0.0)


def _equations(rays: np.ndarray) -> np.ndarray:
    """(T, J, 2, 3) what a place is multiplied by, in each joint's two equations."""
    return np.concatenate([np.broadcast_to(np.eye(2), (*rays.shape, 2)), -rays[..., None]], axis=-1)


def _median(values: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """(T,) median of the seen values of each row (T, J); 0 where none is seen."""
    ordered = np.sort(np.where(usable, values, np.inf), axis=1)
    middle = np.take_along_axis(
        ordered, (usable.sum(axis=1) // 2).clip(max=values.shape[1] - 1)[:, None], axis=1
    )[:, 0]
    return np.where(np.isfinite(middle), middle, 0.0)
