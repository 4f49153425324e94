"""Errors of 3D skeletons against truth; all joints (..., T, 17, 3) relative to the pelvis, in the same axes."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import norm


def relative(joints: np.ndarray) -> np.ndarray:
    """joints (..., 17, 3) minus their pelvis."""
    return joints - joints[..., [H36M17.index("pelvis")], :]


def joint_error(predicted: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(..., T) mean distance over the 17 joints, the pelvis included (MPJPE as usual, Ionescu et al. 2014)."""
    return norm(predicted - truth).mean(axis=-1)
