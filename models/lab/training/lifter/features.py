"""What the lifter sees of 2D keypoints, and what it should answer, in torch (see models/lifter/features.py)."""

from __future__ import annotations

import torch
from torch import Tensor

from .....pipeline.core.layouts import H36M17
from ....lifter.features import CENTRE, HALF_WINDOW, IMAGE_UP, STEEP
from ...synthetic.bodies import STANDARD_SIZE_M, size_m
from ...synthetic.vectors import dot, rotate, transpose, unit


def features(
    keypoints: Tensor, confidence: Tensor, image_size: Tensor, focal_px: Tensor, up: Tensor
) -> tuple[Tensor, Tensor]:
    """As lifter_features.features: keypoints (B, T, 17, 2), confidence (B, T, 17), image_size (B, 2), focal_px (B,),
    up (B, T or 1, 3) -> (B, T, CHANNELS) and R_camera_from_ray (B, T, 3, 3)."""
    rays = (keypoints - image_size[:, None, None] / 2) / focal_px[:, None, None, None]
    present = rays.isfinite().all(-1)
    seen = present.any(-1)
    rays = rays.nan_to_num()
    centre = _filled(_centre(rays, present), seen)
    R_camera_from_ray = ray_rotation(centre, up)
    rise = dot(R_camera_from_ray[..., 2], up)[..., None]
    known = rise.isfinite()
    turned = rotate(transpose(R_camera_from_ray), torch.cat([rays, torch.ones_like(rays[..., :1])], dim=-1))
    turned = turned[..., :2] / turned[..., 2:].clamp_min(0.1) * present[..., None]
    size = (dot(turned, turned).sum(-1) / present.sum(-1).clamp_min(1)).sqrt()
    mean_size = _averaged(size, seen).clamp_min(1e-6)
    path = (centre - torch.stack([_averaged(centre[..., i], seen) for i in (0, 1)], dim=-1)) / mean_size[
        ..., None
    ]
    image = (turned / mean_size[..., None, None]).clamp(-5, 5)
    trust = torch.where(present, confidence.nan_to_num(nan=0.7), 0.0)
    extra = torch.cat(
        [
            (path / 4).tanh(),
            (size / mean_size - 1)[..., None],
            (mean_size.log() + 2)[..., None],
            rise.nan_to_num(),
            known.float(),
        ],
        dim=-1,
    )
    return torch.cat(
        [image.flatten(-2), trust, present.float(), extra * seen[..., None]], dim=-1
    ), R_camera_from_ray


def target(joints_camera: Tensor, up: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 17, 3) what the network should answer for exact joints with the origin at the camera, told up as in
    `features`, and (B, T, 17, 3) their velocities a frame, of the joints relative to the pelvis, in the same axes and
    scale."""
    relative = joints_camera - joints_camera[..., [H36M17.index("pelvis")], :]
    relative = relative * (STANDARD_SIZE_M / size_m(relative))[:, None, None, None]
    rays = joints_camera[..., :2] / joints_camera[..., 2:]
    R_ray_from_camera = transpose(
        ray_rotation(_centre(rays, torch.ones_like(rays[..., 0], dtype=torch.bool)), up)
    )
    return rotate(R_ray_from_camera, relative), rotate(R_ray_from_camera, _velocity(relative))


def ray_rotation(centre: Tensor, up: Tensor) -> Tensor:
    """R_camera_from_ray (..., 3, 3): z along the ray (x, y, 1) of centre (..., 2), x across up (..., 3), or across the
    image's own vertical where up is NaN or the ray goes along it."""
    away = unit(torch.cat([centre, torch.ones_like(centre[..., :1])], dim=-1))
    tells = dot(away, up)[..., None].abs() < STEEP  # False where up is NaN
    image_up = torch.as_tensor(IMAGE_UP, dtype=away.dtype, device=away.device)
    right = unit(torch.cross(away, torch.where(tells, up, image_up), dim=-1))
    return torch.stack([right, torch.cross(away, right, dim=-1), away], dim=-1)


def _velocity(values: Tensor) -> Tensor:
    """Central differences along time (B, T, ...), one-sided at the ends; zero for a single frame."""
    if values.shape[1] == 1:
        return torch.zeros_like(values)
    return torch.gradient(values, dim=1)[0]


def _centre(rays: Tensor, present: Tensor) -> Tensor:
    """Mean of the trunk's joints that are there, else of all that are there."""
    trunk = torch.zeros(len(H36M17), dtype=torch.bool, device=rays.device)
    trunk[CENTRE] = True
    use = torch.where((present & trunk).any(-1, keepdim=True), present & trunk, present)
    return (rays * use[..., None]).sum(-2) / use.sum(-1).clamp_min(1)[..., None]


def _filled(centre: Tensor, seen: Tensor) -> Tensor:
    """centre (B, T, 2) with frames without a person taking the last value before, at the start the first after."""
    frame = torch.arange(seen.shape[1], device=seen.device)
    last = torch.where(seen, frame, -1).cummax(dim=1).values
    source = torch.where(last >= 0, last, seen.int().argmax(dim=1, keepdim=True))
    return centre.gather(1, source[..., None].expand_as(centre))


def _averaged(values: Tensor, seen: Tensor) -> Tensor:
    """(B, T) mean of the seen values within HALF_WINDOW frames; of what there is at the ends of a take."""
    frames = values.shape[1]
    sums = torch.stack([torch.where(seen, values, 0.0), seen.float()], dim=-1).cumsum(1)
    sums = torch.cat([torch.zeros_like(sums[:, :1]), sums], dim=1)
    frame = torch.arange(frames, device=values.device)
    window = (
        sums[:, (frame + HALF_WINDOW + 1).clamp_max(frames)] - sums[:, (frame - HALF_WINDOW).clamp_min(0)]
    )
    return window[..., 0] / window[..., 1].clamp_min(1)
