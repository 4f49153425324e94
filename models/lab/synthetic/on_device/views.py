"""Bodies before random views, in torch (see models/lab/synthetic/views.py for the conventions and the truth)."""

from __future__ import annotations

import torch
from torch import Tensor

from .....pipeline.core.layouts import H36M17
from ....common.vectors import rotate, transpose, unit
from ..bodies import vector
from ..views import Targets, view_rotation
from .draw import Draw

_LEAST_LEVEL = 0.1  # of the two unit axes' sum: hips and shoulders nearer to the vertical tell no heading


def paper_angles(draw: Draw, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Roll, pitch, yaw (count,) in degrees of the published mixture (models/lab/synthetic/views.py)."""
    kind = draw.uniform((0.0, 1.0), count)
    front, side = kind < 0.75, (kind >= 0.75) & (kind < 0.90)

    def normal(front_deg: float, side_deg: float, most_front: float, most_side: float) -> Tensor:
        value = draw.normal(count)
        value, most = value * torch.where(side, side_deg, front_deg), torch.where(side, most_side, most_front)
        return torch.clamp(value, -most, most)

    sideways = torch.where(draw.share(0.5, count), 90.0, -90.0) + 10 * draw.normal(count)
    away = torch.where(side, sideways, 180 + 20 * draw.normal(count))
    yaw = torch.where(front, draw.uniform((-70.0, 70.0), count), away)
    pitch, roll = normal(12.0, 8.0, 20.0, 15.0), normal(4.0, 3.0, 8.0, 6.0)
    return roll, pitch, yaw


def wide_angles(draw: Draw, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Roll, pitch, yaw (count,) in degrees of a camera that is really pitched and rolled."""
    return (
        draw.uniform((-20.0, 20.0), count),
        draw.uniform((-60.0, 60.0), count),
        draw.uniform((-180.0, 180.0), count),
    )


def views(draw: Draw, count: int, wide: float) -> Tensor:
    """R_camera_from_body (count, 3, 3) of random views, a share of them `wide`, the others the paper's."""
    paper = view_rotation("paper", *paper_angles(draw, count))
    return torch.where(draw.share(wide, count, 1, 1), view_rotation("wide", *wide_angles(draw, count)), paper)


def R_world_from_body(joints_world: Tensor) -> Tensor:
    """(B, 3, 3) of joints (B, 17, 3), +Z up, by pipeline/core/canonical.py's definition; NaN for a body whose hips and
    shoulders tell no heading, or almost none."""
    hips, shoulders = (unit(vector(joints_world, f"r_{part}", f"l_{part}")) for part in ("hip", "shoulder"))
    left = hips + shoulders
    left = torch.cat([left[:, :2], torch.zeros_like(left[:, :1])], dim=-1)
    left = torch.where(left.norm(dim=-1, keepdim=True) > _LEAST_LEVEL, unit(left), torch.nan)
    up = torch.zeros_like(left)
    up[:, 2] = 1.0
    return torch.stack([-torch.cross(left, up, dim=-1), -left, up], dim=-1)


def seen(joints_world: Tensor, R_camera_from_body: Tensor, targets: Targets) -> tuple[Tensor, Tensor]:
    """As the truth's: joints (B, 17, 3), +Z up -> (B, 17, 3) in CAMERA axes relative to the pelvis, and (B,) which
    of them have a heading."""
    R = R_camera_from_body
    if targets == "body":
        R = R @ transpose(R_world_from_body(joints_world))
    relative = joints_world - joints_world[:, [H36M17.index("pelvis")]]
    return rotate(R, relative), R.isfinite().all(-1).all(-1)
