"""Rotations and vectors in torch, with the names and conventions of pipeline/core/rotations.py."""

from __future__ import annotations

from collections.abc import Sequence

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
    return v / length(v)[..., None].clamp_min(1e-9)


def dot(v: Tensor, w: Tensor) -> Tensor:
    """(...,) the scalar product of vectors (..., D); a sum over so short an axis is slow in torch."""
    total, *rest = (v[..., i] * w[..., i] for i in range(v.shape[-1]))
    return sum(rest, start=total)


def length(v: Tensor) -> Tensor:
    """(...,) the length of v (..., D)."""
    return dot(v, v).sqrt()


def picked(x: Tensor, rows: Sequence[int]) -> Tensor:
    """x (..., N, D) -> (..., len(rows), D), as x[..., rows, :] in a quarter of its time."""
    return x.index_select(-2, torch.tensor(rows, device=x.device))


def across(v: Tensor, axis: Tensor) -> Tensor:
    """The unit vector of what v (..., 3) has square to a unit axis (..., 3)."""
    return unit(v - dot(v, axis)[..., None] * axis)


def from_vector(v: Tensor) -> Tensor:
    """R (..., 3, 3) of rotation vectors (..., 3), radians (Rodrigues)."""
    angle = length(v)[..., None, None]
    x, y, z = unit(v).unbind(-1)
    zero = torch.zeros_like(x)
    K = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], dim=-1).unflatten(-1, (3, 3))
    return torch.eye(3, device=v.device) + angle.sin() * K + (1 - angle.cos()) * (K @ K)
