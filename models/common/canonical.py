"""The axes of BODY from gravity and the joints: the definition that is the truth on clean joints (design.md 4)."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import from_columns, is_finite, unit

_UP = np.array([0.0, 0.0, 1.0])


def body_axes(joints: np.ndarray, up: np.ndarray) -> np.ndarray:
    """R_source_from_body (T, 3, 3): columns back, right and up of the body, in the axes of the joints.

    joints: (T, 17, 3), H36M17 in any right-handed axes, any origin and unit.
    up: (3,) or (T, 3), against gravity in the same axes, any length.

    The subject faces left x up, where left is the sum of the unit hip axis and the unit shoulder axis (right to
    left), made horizontal. A frame without both hips, both shoulders and up is NaN, as is one whose hips and
    shoulders point straight up or down or against each other.
    """
    joints = np.asarray(joints, dtype=np.float64)
    up = unit(np.broadcast_to(np.asarray(up, dtype=np.float64), (len(joints), 3)))
    left = _axis(joints, "l_hip", "r_hip") + _axis(joints, "l_shoulder", "r_shoulder")
    left = unit(left - (left * up).sum(-1, keepdims=True) * up)
    R_source_from_body = from_columns(-np.cross(left, up), -left, up)
    return np.where(is_finite(left)[:, None, None], R_source_from_body, np.nan)


def R_world_from_body(joints: np.ndarray) -> np.ndarray:
    """(T, 3, 3) for joints (T, 17, 3), H36M17, in axes whose +z points up: a Z-up world, or LEVEL."""
    return body_axes(joints, _UP)


def _axis(joints: np.ndarray, left: str, right: str) -> np.ndarray:
    return unit(joints[:, H36M17.index(left)] - joints[:, H36M17.index(right)])
