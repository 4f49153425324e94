"""The pelvis's path through a take, in the axes of a camera that stands still, with its error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.anthropometry import SEGMENTS, implied_stature
from ...pipeline.camera import Camera
from ...pipeline.frames import CAMERA, require
from ...pipeline.intrinsics import undistorted
from ...pipeline.layouts import H36M17
from ...pipeline.motion.signals import rate
from ...pipeline.motion.visibility import seen_only
from ...pipeline.pose import PoseSequence
from ...pipeline.rotations import known
from .reprojection import placed
from .smoothing import covariances, smoothed

# Every estimator puts nose, head and spine elsewhere, the detector and the lifter too.
JOINTS = tuple(name for name in H36M17.joints if name not in ("spine", "nose", "head"))
SCALE_SD = (
    0.03  # of the distance: the error of the body's size, which moves the whole path to or from the camera
)
_UNKNOWN_CONFIDENCE = 0.7  # as for the lifter
_JOLT = 0.2  # statures^2 / s^3, power spectral density of the pelvis's acceleration
_LASTS_S = 1.0  # of the errors of joints: so much of a take counts as one independent frame
_STRAY = 3.0  # standard deviations off the path at which a frame's weight is halved
_LONGEST_ERROR = (
    0.25  # statures along any direction, of the frame's own error: beyond it a gap is not bridged
)
_GROWS = 0.05  # spread of the logarithm of the body's size beyond which it follows the image's; a lifter's is below 0.03
_SIZE_S = 0.5  # over which the body's size is averaged before it is evened out


@dataclass(frozen=True, eq=False)
class PelvisPath:
    """root: (T, 3) the pelvis from the camera, CAMERA axes, in the joints' unit, NaN where it is not known. own: (T, 3,
    3) covariance of each frame's own error. focal_sd: standard deviation of the focal length as a share of it. evened:
    whether the body grew and shrank with its image and was brought to one size."""

    root: np.ndarray
    own: np.ndarray
    focal_sd: float
    evened: bool

    @property
    def covariance(self) -> np.ndarray:
        """(T, 3, 3) of the whole error: besides the frame's own what is the same throughout the take, the error of the
        body's size, which makes all distances larger or smaller, and that of the focal length, all depths."""
        depth = self.root * [0.0, 0.0, 1.0]
        return self.own + SCALE_SD**2 * _outer(self.root) + self.focal_sd**2 * _outer(depth)


def pelvis_path(poses: PoseSequence, keypoints: PoseSequence, camera: Camera) -> PelvisPath | None:
    """The pelvis's path before a camera that stands still; None where too few joints tell where it is.

    poses: H36M17 in CAMERA axes, relative to the pelvis, with times, in any unit. keypoints: of the same person, pixels
    as they were filmed, in any layout that has H36M17's joints; rows belong together by their frame numbers. Those that
    nobody saw (visibility.unseen) are not used. InputError for poses in other axes or without times.

    Frames are placed one by one (`placed`) and smoothed together (`smoothed`); frames far off the path, which show
    somebody else, are weighed down.
    """
    require(poses.frame, CAMERA, "pelvis_path")
    if camera.intrinsics is not None:
        keypoints = keypoints.with_(joints=undistorted(keypoints.joints, camera.intrinsics))
    seen = seen_only(keypoints, camera.image_size)
    rows = np.minimum(np.searchsorted(seen.frame_index, poses.frame_index), len(seen) - 1)
    there = (seen.frame_index[rows] == poses.frame_index)[:, None]
    rays = (seen.joints[rows] - np.array(camera.image_size) / 2) / camera.focal_px
    rays = np.where(there[..., None], rays, np.nan)
    focal_sd = camera.focal_sd_px / camera.focal_px
    return _path(poses.joints, rays, seen.confidence[rows], poses.times, focal_sd)


def _path(
    joints: np.ndarray, rays: np.ndarray, confidence: np.ndarray, time_s: np.ndarray, focal_sd: float
) -> PelvisPath | None:
    """joints: (T, 17, 3). rays: (T, 17, 2) x / z and y / z of the keypoints; confidence: (T, 17). NaN where missing.
    time_s: (T,). focal_sd: standard deviation of the focal length as a share of it."""
    stature = implied_stature(joints)
    if not stature > 0 or len(joints) < 3:
        return None
    body, evened = _evened(joints.astype(np.float64) / stature, time_s)
    use = H36M17.indices(JOINTS)
    trust = np.where(np.isfinite(confidence), confidence, _UNKNOWN_CONFIDENCE)[:, use] ** 2
    places, information = placed(rays[:, use].astype(np.float64), body[:, use], trust)
    information = information / max(_LASTS_S * rate(time_s), 1.0)
    if known(places).sum() < 2:
        return None
    path, _ = smoothed(places, information, time_s, _JOLT)
    information = information * _weights(places - path, information)[:, None, None]
    path, factor = smoothed(places, information, time_s, _JOLT)
    own = covariances(factor)
    lost = np.sqrt(np.linalg.eigvalsh(own)[:, -1]) > _LONGEST_ERROR
    return PelvisPath(
        root=np.where(lost[:, None], np.nan, path * stature),
        own=np.where(lost[:, None, None], np.nan, own * stature**2),
        focal_sd=focal_sd,
        evened=evened,
    )


def _evened(joints: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, bool]:
    """The body (T, 17, 3) at one size where its own changes: lifters that see a crop let it grow with its image."""
    from scipy.ndimage import gaussian_filter1d

    ends = np.array([H36M17.indices(bone) for bone in SEGMENTS])
    lengths = np.linalg.norm(joints[:, ends[:, 0]] - joints[:, ends[:, 1]], axis=-1)
    seen = np.isfinite(lengths)
    usual = np.nanmedian(lengths[:, seen.any(axis=0)], axis=0, keepdims=True)
    seen, lengths = seen[:, seen.any(axis=0)], lengths[:, seen.any(axis=0)]
    rows = np.flatnonzero(seen.any(axis=1))
    size = np.where(seen, lengths, 0.0).sum(axis=1)[rows] / np.where(seen, usual, 0.0).sum(axis=1)[rows]
    size = np.interp(time_s, time_s[rows], np.log(np.maximum(size, 1e-6)))
    size = gaussian_filter1d(size, _SIZE_S * rate(time_s), mode="nearest")
    if not size.std() > _GROWS:
        return joints, False
    return joints / np.exp(size - np.median(size))[:, None, None], True


def _weights(off: np.ndarray, information: np.ndarray) -> np.ndarray:
    """(T,) Cauchy weights of frames that are (T, 3) off the path."""
    off = np.where(np.isfinite(off), off, 0.0)
    return 1 / (1 + np.einsum("ti,tij,tj->t", off, information, off) / _STRAY**2)


def _outer(x: np.ndarray) -> np.ndarray:
    return x[:, :, None] * x[:, None, :]
