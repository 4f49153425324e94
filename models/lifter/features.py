"""The built-in network's input, out of 2D keypoints: image size, place in the image and size of the person taken out.

Pixels become rays; each frame is turned so that the ray to the body's centre is the optical axis (the ray frame),
because a person at the border of the image is seen from another side than one in the middle; then the image
is divided by the body's size, averaged over some seconds. Where up is known the ray frame stands upright, and the
network is told how steeply it looks down: a person is more likely to stand than to lean.

A run does this in numpy, the training (models/lab/training/lifter.py) in torch.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pipeline.core.layouts import H36M17
from ..common.vectors import Array, dot, library_of, rotate, transpose, unit

ASSUMED_FOCAL = 1.0  # of the longer image side: between phones (0.7-0.85) and normal lenses (1.2-2)
HALF_WINDOW = 40  # frames on each side over which place and size are averaged
CHANNELS = 4 * len(H36M17) + 6
_IMAGE_UP = np.array([0.0, -1.0, 0.0])
# Of the cosine between ray and up beyond which up says nothing about what is upright in the image.
_STEEP = 0.98
_TRUNK = ("pelvis", "spine", "thorax", "l_hip", "r_hip", "l_shoulder", "r_shoulder")
_OF_TRUNK = [joint in _TRUNK for joint in H36M17.joints]


def features(
    keypoints: Array, confidence: Array, image_size: Array, focal_px: Array, up: Array | None = None
) -> tuple[Array, Array]:
    """The network's input and the rotation that leads back.

    keypoints: (..., T, 17, 2) pixels, NaN where missing. confidence: (..., T, 17), NaN where unknown.
    image_size: (..., 2) width, height. focal_px: (...,). up: (..., T or 1, 3) unit, in the camera, NaN where unknown.
    -> (..., T, CHANNELS) float32: x, y, confidence and presence of each joint, the body's way across the image
    (2), its size against the averaged size, the averaged size, the cosine between ray and up (0 where unknown), and
    whether that is known; and R_camera_from_ray (..., T, 3, 3).
    Any number of frames; a frame without joints is all zeros.
    """
    library: Any = library_of(keypoints)
    rays = (keypoints - image_size[..., None, None, :] / 2) / focal_px[..., None, None, None]
    present = library.isfinite(rays).all(-1)
    visible = present.any(-1)
    rays = library.nan_to_num(rays, posinf=0.0, neginf=0.0)
    centre = _filled(_centre(rays, present), visible)
    told_up: Any = np.nan * _homogeneous(centre) if up is None else up
    R_camera_from_ray = ray_rotation(centre, told_up)
    rise = dot(R_camera_from_ray[..., 2], told_up)
    up_is_known = library.isfinite(rise)
    turned = rotate(transpose(R_camera_from_ray), _homogeneous(rays))
    turned = turned[..., :2] / turned[..., 2:].clip(0.1) * present[..., None]

    size = library.sqrt((turned**2).sum((-2, -1)) / present.sum(-1).clip(1))
    mean_size = _averaged(size, visible).clip(1e-6)
    usual = library.stack([_averaged(centre[..., i], visible) for i in (0, 1)], -1)
    beside_usual = library.tanh((centre - usual) / mean_size[..., None] / 4)
    image = (turned / mean_size[..., None, None]).clip(-5, 5)
    trust = library.where(present, library.where(library.isnan(confidence), 0.7, confidence), 0.0)
    size_and_up = (
        size / mean_size - 1,
        library.log(mean_size) + 2,
        library.where(up_is_known, rise, 0.0),
        1.0 * up_is_known,
    )
    extra = library.stack([beside_usual[..., 0], beside_usual[..., 1], *size_and_up], -1)
    flat = image.reshape(*image.shape[:-2], -1)
    parts = [flat, trust, 1.0 * present, library.where(visible[..., None], extra, 0.0)]
    return library.asarray(library.concatenate(parts, -1), dtype=library.float32), R_camera_from_ray


def body_rays(joints_camera: Array, up: Array | None = None) -> Array:
    """R_camera_from_ray (..., 3, 3) of exact joints (..., 17, 3) with the origin at the camera; up: as `ray_rotation`
    takes it."""
    library: Any = library_of(joints_camera)
    rays = joints_camera[..., :2] / joints_camera[..., 2:]
    return ray_rotation(_centre(rays, library.ones_like(rays[..., 0], dtype=library.bool)), up)


def ray_rotation(centre: Array, up: Array | None = None) -> Array:
    """R_camera_from_ray (..., 3, 3): z along the ray (x, y, 1) of centre (..., 2), x across up (..., 3), unit; across
    the image's own vertical where up is NaN or not given, or the ray goes along it."""
    library: Any = library_of(centre)
    away = unit(_homogeneous(centre))
    upwards = _IMAGE_UP if library is np else library.tensor(_IMAGE_UP, dtype=away.dtype, device=away.device)
    if up is not None:
        tells = abs(dot(away, up))[..., None] < _STEEP  # False where up is NaN
        upwards = library.where(tells, up, upwards)
    right = unit(library.linalg.cross(away, upwards))
    return library.stack([right, library.linalg.cross(away, right), away], -1)


def _homogeneous(places: Array) -> Array:
    """(..., 3) of places (..., 2) on the plane at 1 before the camera."""
    library: Any = library_of(places)
    return library.concatenate([places, library.ones_like(places[..., :1])], -1)


def _centre(rays: Array, present: Array) -> Array:
    """Mean of the trunk's joints that are there, else of all that are there."""
    library: Any = library_of(rays)
    of_trunk = present & library.asarray(_OF_TRUNK, device=rays.device)
    use: Any = library.where(of_trunk.any(-1)[..., None], of_trunk, present)
    return (rays * use[..., None]).sum(-2) / use.sum(-1).clip(1)[..., None]


def _filled(centre: Array, visible: Array) -> Array:
    """centre (..., T, 2) with frames without a person taking the last value before, at the start the first after."""
    library: Any = library_of(centre)
    frame = library.arange(visible.shape[-1], device=centre.device)
    last: Any = library.where(visible, frame, -1)
    last = np.maximum.accumulate(last, -1) if library is np else last.cummax(-1).values
    source = library.where(last >= 0, last, (1 * visible).argmax(-1)[..., None])[..., None]
    take_along: Any = np.take_along_axis if library is np else library.take_along_dim
    return take_along(centre, source, -2)


def _averaged(values: Array, visible: Array) -> Array:
    """(..., T) mean of the seen values within HALF_WINDOW frames; of what there is at the ends of a take."""
    library: Any = library_of(values)
    frames = values.shape[-1]
    sums = library.cumsum(library.stack([library.where(visible, values, 0.0), 1.0 * visible], -1), -2)
    sums = library.concatenate([library.zeros_like(sums[..., :1, :]), sums], -2)
    frame = library.arange(frames, device=values.device)
    first, behind = (frame - HALF_WINDOW).clip(min=0), (frame + HALF_WINDOW + 1).clip(max=frames)
    window = sums[..., behind, :] - sums[..., first, :]
    return window[..., 0] / window[..., 1].clip(1)
