"""The pelvis's path through a take, in the axes of a camera that stands still, with its error.

Noisy places of known errors are smoothed over the whole take at once. The prior is white acceleration (an integrated
Wiener process of the velocity), as in a Kalman smoother; a place that is certain across the line of sight and uncertain
along it is smoothed the more along it. Solved as one banded system of normal equations; the covariances are the
diagonal blocks of its inverse.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.core.anthropometry import SEGMENTS, implied_stature
from ...pipeline.core.camera import Camera
from ...pipeline.core.frames import CAMERA, require
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, known_median, norm
from ...pipeline.signals.filters import gaussian, rate
from ...pipeline.signals.reprojection import JOINTS, keypoint_rays, placed
from ..common.splines import inverse_band

FEWEST_FRAMES = 3  # a path is smoothed by its acceleration, and two have none
# Of the distance: the body's size, as a stature gives it, moves the whole path to or from the camera.
SCALE_SD = 0.037
# What a frame errs by beside, as the lifted body is wrong: of the distance, from posture to posture; and in statures,
# with legs that are folded and arms that are raised by one unit of posture.folding. Fitted to 166 takes of 9 validation
# people, each counted the same, before cameras on any side and typical ones, also with a detector that errs up to twice
# as much in unusual postures (seed 0). Before other cameras on any side (seeds 5 to 7) 91 % of the frames are
# within; of 4 people who crouch 80, of 4 who lie 74, with the image 82. The covariance is without it, as gait errors
# were fitted.
POSTURE_SD, FOLDING_SD = 0.0136, (0.148, 0.133)
# The share of the frames whose posture is no more unusual than the one that the error of every frame is stated by. By
# their mean, a quarter of the frames of people who crouch for a part of a take were outside, not a tenth.
UNUSUAL = 0.9
_JOLT = 0.2  # statures^2 / s^3, power spectral density of the pelvis's acceleration
_LASTS_S = 1.0  # of the errors of joints: so much of a take counts as one independent frame
_ROUNDS = 3  # of weighing frames by how far they are off the path
_STRAY = 3.0  # standard deviations off the path at which a frame's weight is halved
_MOST = 0.25  # statures along any direction, of a frame's own error: a gap is not bridged beyond it
_GROWS = 0.03  # spread of the logarithm of the body's size from which it may follow the image; the lifter's is smaller
_SIZE_S = 0.5  # over which sizes are averaged
_ROOM = 100.0  # units that a place may be from the mean one: a weak prior, so that no gap is too long to be solved
_BAND = 6  # values that a value is tied to: the three coordinates of the next two frames


@dataclass(frozen=True, eq=False)
class PelvisPath:
    """root: (T, 3) the pelvis from the camera, CAMERA axes, in the joints' unit, NaN where it is not known. own: (T, 3,
    3) covariance of each frame's own error. focal_sd: standard deviation of the focal length as a share of it. growth:
    (T,) what the joints are to be divided by: the size of a body that follows its image over the usual one, else 1."""

    root: np.ndarray
    own: np.ndarray
    focal_sd: float
    growth: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """(T, 3, 3) of the whole error: besides the frame's own what is the same throughout the take, the error of the
        body's size, which makes all distances larger or smaller, and that of the focal length, all depths."""
        depth = self.root * [0.0, 0.0, 1.0]
        return self.own + SCALE_SD**2 * _outer(self.root) + self.focal_sd**2 * _outer(depth)


def pelvis_path(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> PelvisPath | None:
    """The pelvis's path before a camera that stands still, or shakes, which each frame's own error has then; None where
    too few joints tell where it is, and of fewer than FEWEST_FRAMES.

    poses: H36M17 in CAMERA axes, relative to the pelvis, with times, in any unit. keypoints: of the same person, pixels
    as they were filmed, in any layout that has H36M17's joints; rows belong together by their frame numbers. Those that
    nobody saw (visibility.unseen) are not used. InputError for poses in other axes or without times.

    Frames are placed one by one (`placed`) and smoothed together (`smoothed`); frames far off the path, which show
    somebody else, are weighed down.
    """
    require(poses.frame, CAMERA, "pelvis_path")
    rays, trust = keypoint_rays(poses, keypoints, camera)
    joints, time_s = poses.without_feet.joints, poses.times
    stature = implied_stature(joints)
    if not stature > 0 or len(joints) < FEWEST_FRAMES:
        return None
    growth = _growth(joints.astype(np.float64), rays, time_s)
    body = joints / (stature * growth)[:, None, None]
    use = H36M17.indices(JOINTS)
    places, information = placed(rays[:, use].astype(np.float64), body[:, use], trust[:, use])
    information = information / max(_LASTS_S * rate(time_s), 1.0)
    if is_finite(places).sum() < 2:
        return None
    weights = np.ones(len(places))
    for _ in range(_ROUNDS + 1):
        path, factor = smoothed(places, information * weights[:, None, None], time_s, _JOLT)
        # Cauchy weights of frames that are off the path.
        off = np.nan_to_num(places - path)
        weights = 1 / (1 + np.einsum("ti,tij,tj->t", off, information, off) / _STRAY**2)
    own = covariances(factor)
    lost = np.sqrt(np.linalg.eigvalsh(own)[:, -1]) > _MOST
    root = np.where(lost[:, None], np.nan, path * stature)
    shaken = (camera.shake_rad * root[:, 2, None]) ** 2 * [1.0, 1.0, 0.0]
    return PelvisPath(
        root=root,
        own=np.where(lost[:, None, None], np.nan, own * stature**2) + shaken[:, None] * np.eye(3),
        focal_sd=camera.focal_sd_px / camera.focal_px,
        growth=growth,
    )


def _growth(joints: np.ndarray, rays: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T,) size of the body over its usual one where it follows the image's, as with lifters that see a crop; else 1.

    joints: (T, 17, 3); rays: (T, 17, 2). Bones have the body's size, and their image over what they are across the view
    tells how near the body is: a body that grows as it comes nearer follows its image.
    """
    ends = np.array([H36M17.indices(bone) for bone in SEGMENTS])
    bones, images = (points[:, ends[:, 1]] - points[:, ends[:, 0]] for points in (joints, rays))
    length, apart = (norm(lines) for lines in (bones, images))
    visible = np.isfinite(length) & np.isfinite(apart)
    if visible.any(axis=1).sum() < 2:
        return np.ones(len(joints))
    usual = np.array([known_median(of_bone) for of_bone in np.where(visible, length, np.nan).T])
    across = norm(bones[..., :2])
    totals = (np.where(visible, lengths, 0.0).sum(axis=1) for lengths in (length, usual[None], apart, across))
    whole, expected, image, flat = (np.where(visible.any(axis=1), total, np.nan) for total in totals)
    size = _slow(whole / expected, time_s)
    near = size + _slow(image / flat, time_s)
    follows = ((size - size.mean()) * (near - near.mean())).mean() > 0.5 * near.var()
    return np.exp(size - np.median(size)) if follows and size.std() > _GROWS else np.ones(len(joints))


def _slow(ratio: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T,) logarithm of a positive ratio, averaged over _SIZE_S; what is missing lies on a line."""
    positive = ratio > 0
    even = np.interp(time_s, time_s[positive], np.log(ratio[positive]))
    sd = _SIZE_S * rate(time_s)
    ends = min(int(4 * sd), len(even) - 1)
    padded = np.pad(even, ends, mode="reflect", reflect_type="odd")  # a trend goes on beyond the ends
    return gaussian(padded, sd)[ends : ends + len(even)]


def _outer(x: np.ndarray) -> np.ndarray:
    return x[:, :, None] * x[:, None, :]


def smoothed(
    places: np.ndarray, information: np.ndarray, time_s: np.ndarray, jolt: float
) -> tuple[np.ndarray, np.ndarray]:
    """The path (T, 3), and the factor of its information, from which `covariances` gets its error.

    places: (T, 3), of which the information (T, 3, 3) is zero where they are NaN; at least two frames must have some.
    time_s: (T,) increasing. jolt: power spectral density of the acceleration, unit^2 / s^3. Gaps are bridged, and ends
    continued, at an even velocity, with an error that grows.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded

    count = len(places)
    middle = np.nanmean(places, axis=0)
    band = np.zeros((_BAND + 1, 3 * count))
    for i in range(3):
        for j in range(i + 1):
            band[i - j, j::3] = information[:, i, j]
    for offset, values in enumerate(_stiffness(time_s, jolt)):
        band[3 * offset] += np.repeat(values, 3)
    band[0] += _ROOM**-2
    off = np.where(np.isfinite(places), places - middle, 0.0)
    right = np.einsum("tij,tj->ti", information, off)
    factor = cholesky_banded(band, lower=True)
    path = cho_solve_banded((factor, True), right.ravel()).reshape(count, 3)
    return middle + path, factor


def _stiffness(time_s: np.ndarray, jolt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Diagonals 0, 1 and 2, each (T,), of the sum of squared second differences over their variances."""
    count = len(time_s)
    before, after = np.diff(time_s)[:-1], np.diff(time_s)[1:]
    middle = (before + after) / 2
    first, last = 1 / (before * middle), 1 / (after * middle)
    parts = (first, -(first + last), last)
    diagonals = np.zeros((3, count))
    for i in range(3):
        for j in range(i, 3):
            diagonals[j - i, i : i + count - 2] += middle / jolt * parts[i] * parts[j]
    return diagonals[0], diagonals[1], diagonals[2]


def covariances(factor: np.ndarray) -> np.ndarray:
    """(T, 3, 3) covariance of each place of a path of `smoothed`, by its factor."""
    diagonals = inverse_band(factor[..., None])
    blocks = np.empty((factor.shape[1] // 3, 3, 3))
    for i in range(3):
        for j in range(i + 1):
            blocks[:, i, j] = blocks[:, j, i] = diagonals[i - j][j::3, 0]
    return blocks
