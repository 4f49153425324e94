"""What the lifter should answer to 2D keypoints, in torch; what it sees of them is in models/lifter/features.py."""

from __future__ import annotations

import torch
from torch import Tensor

from .....pipeline.core.layouts import H36M17
from ....common.vectors import rotate, transpose
from ....lifter.features import body_rays
from ...synthetic.bodies import STANDARD_SIZE_M, size_m


def target(joints_camera: Tensor, up: Tensor) -> tuple[Tensor, Tensor]:
    """(B, T, 17, 3) what the network should answer for exact joints with the origin at the camera, told up as in
    `features`, and (B, T, 17, 3) their velocities a frame, of the joints relative to the pelvis, in the same axes and
    scale."""
    relative = joints_camera - joints_camera[..., [H36M17.index("pelvis")], :]
    relative = relative * (STANDARD_SIZE_M / size_m(relative))[:, None, None, None]
    R_ray_from_camera = transpose(body_rays(joints_camera, up))
    return rotate(R_ray_from_camera, relative), rotate(R_ray_from_camera, _velocity(relative))


def _velocity(values: Tensor) -> Tensor:
    """Central differences along time (B, T, ...), one-sided at the ends; zero for a single frame."""
    if values.shape[1] == 1:
        return torch.zeros_like(values)
    return torch.gradient(values, dim=1)[0]
