"""What the lifter sees of 2D keypoints: image size, place in the image and size of the person taken out.

Pixels become rays; each frame is turned so that the ray to the body's centre is the optical axis (the ray frame),
because a person at the border of the image is seen from another side than one in the middle; then the image
is divided by the body's size, averaged over some seconds. Where up is known the ray frame stands upright, and the
network is told how steeply it looks down: a person is more likely to stand than to lean.
"""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import is_finite, rotate, transpose, unit

ASSUMED_FOCAL = 1.0  # of the longer image side: between phones (0.7-0.85) and normal lenses (1.2-2)
HALF_WINDOW = 40  # frames on each side over which place and size are averaged
CHANNELS = 4 * len(H36M17) + 6
IMAGE_UP = np.array([0.0, -1.0, 0.0])
STEEP = (
    0.98  # of the cosine between ray and up beyond which up says nothing about what is upright in the image
)
CENTRE = H36M17.indices(("pelvis", "spine", "thorax", "l_hip", "r_hip", "l_shoulder", "r_shoulder"))


def features(
    keypoints: np.ndarray,
    confidence: np.ndarray,
    image_size: np.ndarray,
    focal_px: np.ndarray,
    up: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The network's input and the rotation that leads back.

    keypoints: (..., T, 17, 2) pixels, NaN where missing. confidence: (..., T, 17), NaN where unknown.
    image_size: (..., 2) width, height. focal_px: (...,). up: (..., T, 3) unit, in the camera, NaN where unknown.
    -> (..., T, CHANNELS) float32: x, y, confidence and presence of each joint, the body's way across the image
    (2), its size against the averaged size, the averaged size, the cosine between ray and up (0 where unknown), and
    whether that is known; and R_camera_from_ray (..., T, 3, 3).
    Any number of frames; a frame without joints is all zeros.
    """
    rays = (keypoints - image_size[..., None, None, :] / 2) / focal_px[..., None, None, None]
    present = is_finite(rays)
    seen = np.any(present, axis=-1)
    centre = body_centre(rays)
    rays = np.where(present[..., None], rays, 0.0)
    if up is None:
        up = np.full((*centre.shape[:-1], 3), np.nan)
    R_camera_from_ray = ray_rotation(centre, up)
    rise = (R_camera_from_ray[..., 2] * up).sum(-1)
    known = np.isfinite(rise)
    turned = _turned(rays, R_camera_from_ray)
    turned = np.where(present[..., None], turned, 0.0)

    count = np.maximum(present.sum(axis=-1), 1)
    size = np.sqrt((turned**2).sum(axis=(-2, -1)) / count)
    mean_size = np.maximum(_averaged(size, seen), 1e-6)
    way = (centre - np.stack([_averaged(centre[..., i], seen) for i in (0, 1)], axis=-1)) / mean_size[
        ..., None
    ]
    image = np.clip(turned / mean_size[..., None, None], -5, 5)
    trust = np.where(present, np.where(np.isnan(confidence), 0.7, confidence), 0.0)
    extra = np.stack(
        [
            *np.moveaxis(np.tanh(way / 4), -1, 0),
            size / mean_size - 1,
            np.log(mean_size) + 2,
            np.where(known, rise, 0.0),
            known,
        ],
        axis=-1,
    )
    flat = image.reshape(*image.shape[:-2], -1)
    out = np.concatenate([flat, trust, present, np.where(seen[..., None], extra, 0.0)], axis=-1)
    return out.astype(np.float32), R_camera_from_ray


def body_centre(points: np.ndarray) -> np.ndarray:
    """(..., T, 2) middle of the body of H36M17 points (..., T, 17, 2); frames without any take a neighbour's."""
    present = is_finite(points)
    return _filled(_centre(np.where(present[..., None], points, 0.0), present), np.any(present, axis=-1))


def body_rays(joints_camera: np.ndarray) -> np.ndarray:
    """R_camera_from_ray (..., 3, 3) of exact joints (..., 17, 3) with the origin at the camera."""
    rays = joints_camera[..., :2] / joints_camera[..., 2:]
    return ray_rotation(_centre(rays, np.ones(rays.shape[:-1], dtype=bool)))


def ray_rotation(centre: np.ndarray, up: np.ndarray = IMAGE_UP) -> np.ndarray:
    """R_camera_from_ray (..., 3, 3): z along the ray (x, y, 1) of centre (..., 2), x across up (..., 3), unit; across
    the image's own vertical where up is NaN or the ray goes along it."""
    away = unit(np.concatenate([centre, np.ones_like(centre[..., :1])], axis=-1))
    tells = np.abs((away * up).sum(-1, keepdims=True)) < STEEP  # False where up is NaN
    right = unit(np.cross(away, np.where(tells, up, IMAGE_UP)))
    return np.stack([right, np.cross(away, right), away], axis=-1)


def flipped(x: np.ndarray) -> np.ndarray:
    """Features (..., CHANNELS) of the mirrored person."""
    joints = len(H36M17)
    image = x[..., : 2 * joints].reshape(*x.shape[:-1], joints, 2)[..., H36M17.mirror, :]
    image = (image * np.array([-1, 1], dtype=x.dtype)).reshape(*x.shape[:-1], -1)
    trust = x[..., 2 * joints : 3 * joints][..., H36M17.mirror]
    present = x[..., 3 * joints : 4 * joints][..., H36M17.mirror]
    extra = x[..., 4 * joints :] * np.array([-1, 1, 1, 1, 1, 1], dtype=x.dtype)
    return np.concatenate([image, trust, present, extra], axis=-1)


def _turned(rays: np.ndarray, R_camera_from_ray: np.ndarray) -> np.ndarray:
    homogeneous = np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1)
    turned = rotate(transpose(R_camera_from_ray), homogeneous)
    return turned[..., :2] / np.maximum(turned[..., 2:], 0.1)


def _centre(rays: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Mean of the trunk's joints that are there, else of all that are there."""
    trunk = np.zeros(len(H36M17), dtype=bool)
    trunk[CENTRE] = True
    use = np.where((present & trunk).any(axis=-1, keepdims=True), present & trunk, present)
    return (rays * use[..., None]).sum(axis=-2) / np.maximum(use.sum(axis=-1), 1)[..., None]


def _filled(centre: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """centre (..., T, 2) with frames without a person taking the last value before, at the start the first after."""
    frames = seen.shape[-1]
    last = np.maximum.accumulate(np.where(seen, np.arange(frames), -1), axis=-1)
    first = np.argmax(seen, axis=-1)[..., None]
    source = np.where(last >= 0, last, first)
    return np.take_along_axis(centre, source[..., None], axis=-2)


def _averaged(values: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(..., T) mean of the seen values within HALF_WINDOW frames; of what there is at the ends of a take."""
    frames = values.shape[-1]
    sums = np.cumsum(np.stack([np.where(seen, values, 0.0), seen], axis=-1), axis=-2)
    sums = np.concatenate([np.zeros_like(sums[..., :1, :]), sums], axis=-2)
    frame = np.arange(frames)
    window = (
        sums[..., np.minimum(frame + HALF_WINDOW + 1, frames), :]
        - sums[..., np.maximum(frame - HALF_WINDOW, 0), :]
    )
    return window[..., 0] / np.maximum(window[..., 1], 1)
