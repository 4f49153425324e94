"""The axes of BODY from gravity and the joints: the definition that is the truth on clean joints (design.md 4)."""

from __future__ import annotations

import numpy as np

from .layouts import H36M17
from .rotations import angle_deg, from_columns, is_finite, unit

LYING_DEG = 60.0  # from the vertical, beyond which a trunk no longer tells which way is up
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


def trunk_lean_deg(joints: np.ndarray) -> np.ndarray:
    """(...,) the angle in degrees between the trunk, mid-hips to mid-shoulders, of joints (..., 17, 3) and +z; NaN
    where one of the four is missing."""
    hips, shoulders = (
        joints[..., H36M17.indices((f"l_{part}", f"r_{part}")), :].mean(axis=-2)
        for part in ("hip", "shoulder")
    )
    trunk = (shoulders - hips).astype(np.float64)
    return np.asarray(angle_deg(trunk, np.broadcast_to(_UP, trunk.shape)))


def _axis(joints: np.ndarray, left: str, right: str) -> np.ndarray:
    return unit(joints[:, H36M17.index(left)] - joints[:, H36M17.index(right)])
