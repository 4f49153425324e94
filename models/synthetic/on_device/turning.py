"""Rotations in torch, with the names and conventions of pipeline/rotations.py."""

from __future__ import annotations

import torch
from torch import Tensor


def rotate(R: Tensor, x: Tensor) -> Tensor:
    """Apply R (..., D, D) to points x (..., N, D), each point as a column vector: R x."""
    return torch.einsum("...ij,...kj->...ki", R, x)


def transpose(R_a_from_b: Tensor) -> Tensor:
    """R_b_from_a (..., D, D), the inverse of a rotation."""
    return R_a_from_b.transpose(-1, -2)


def unit(v: Tensor) -> Tensor:
    """v (..., D) over its length; a zero vector stays zero."""
    return v / v.norm(dim=-1, keepdim=True).clamp_min(1e-9)


def across(v: Tensor, axis: Tensor) -> Tensor:
    """The unit vector of what v (..., 3) has square to a unit axis (..., 3)."""
    return unit(v - (v * axis).sum(-1, keepdim=True) * axis)


def from_vector(v: Tensor) -> Tensor:
    """R (..., 3, 3) of rotation vectors (..., 3), radians (Rodrigues)."""
    angle = v.norm(dim=-1)[..., None, None]
    x, y, z = unit(v).unbind(-1)
    zero = torch.zeros_like(x)
    K = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))
    return torch.eye(3, device=v.device) + angle.sin() * K + (1 - angle.cos()) * (K @ K)
