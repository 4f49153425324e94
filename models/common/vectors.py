"""Vectors and rotations of numpy's arrays and of torch's tensors alike, with the names and conventions of
pipeline/core/rotations.py. Needs no torch for numpy's. For what runs in numpy and is trained in torch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from torch import Tensor

Array = TypeVar("Array", np.ndarray, "Tensor")


def library_of(x: Any) -> Any:
    """numpy for its arrays, torch for its tensors; what both name alike works on either."""
    if isinstance(x, np.ndarray):
        return np
    import torch

    return torch


def rotate(R: Array, x: Array) -> Array:
    """Apply R (..., D, D) to points x (..., N, D), each point as a column vector: R x."""
    return library_of(x).einsum("...ij,...kj->...ki", R, x)


def transpose(R_a_from_b: Array) -> Array:
    """R_b_from_a (..., D, D), the inverse of a rotation."""
    return R_a_from_b.swapaxes(-1, -2)


def unit(v: Array) -> Array:
    """v (..., D) over its length; a zero vector stays zero."""
    return v / length(v)[..., None].clip(1e-9)


def dot(v: Array, w: Array) -> Array:
    """(...,) the scalar product of vectors (..., D); a sum over so short an axis is slow in torch."""
    total, *rest = (v[..., i] * w[..., i] for i in range(v.shape[-1]))
    return sum(rest, start=total)


def length(v: Array) -> Array:
    """(...,) the length of v (..., D)."""
    return library_of(v).sqrt(dot(v, v))


def picked(x: Array, rows: Sequence[int]) -> Array:
    """x (..., N, D) -> (..., len(rows), D), a copy; in torch in a quarter of the time of x[..., rows, :]."""
    if isinstance(x, np.ndarray):
        return x[..., list(rows), :]
    return x.index_select(-2, library_of(x).tensor(rows, device=x.device))


def across(v: Array, axis: Array) -> Array:
    """The unit vector of what v (..., 3) has square to a unit axis (..., 3)."""
    return unit(v - dot(v, axis)[..., None] * axis)
