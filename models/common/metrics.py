"""Errors of 3D skeletons against truth; all joints (..., T, 17, 3) relative to the pelvis, in the same axes."""

from __future__ import annotations

from dataclasses import asdict, is_dataclass
from typing import Any

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import kabsch, norm, rotate

# Of a direction whose error is Gaussian in two dimensions: what holds nine in ten, over the root mean square.
RAYLEIGH_90 = float(np.sqrt(np.log(10)))


def plain(value: Any) -> Any:
    """Nested figures as what JSON knows; NaN and infinity become null."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, dict):
        return {str(key): plain(part) for key, part in value.items()}
    return [plain(part) for part in value] if isinstance(value, list | tuple) else value


def relative(joints: np.ndarray) -> np.ndarray:
    """joints (..., 17, 3) minus their pelvis."""
    return joints - joints[..., [H36M17.index("pelvis")], :]


def joint_error(predicted: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(..., T) mean distance over the 17 joints, the pelvis included (MPJPE as usual, Ionescu et al. 2014)."""
    return norm(predicted - truth).mean(axis=-1)


def rigid_error(predicted: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(..., T) the same after the best rotation and shift of every frame, sizes as they are."""
    a = truth - truth.mean(axis=-2, keepdims=True)
    b = predicted - predicted.mean(axis=-2, keepdims=True)
    return joint_error(rotate(kabsch(a, b), b), a)
