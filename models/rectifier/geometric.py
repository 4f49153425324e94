"""The geometric baseline of the paper: the torso's own axes, without gravity (design.md section 4)."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import from_columns, is_finite, unit


class Geometric:
    """GEOMETRIC. rotation(Q x) = Q rotation(x) for any rotation Q; a bent trunk tilts its result."""

    method = "geometric"

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """joints (T, 17, 3) in any right-handed axes -> R_source_from_body (T, 3, 3), error_deg (T,) all NaN.

        A frame without both shoulders and both hips is NaN.
        """
        l_shoulder, r_shoulder, l_hip, r_hip = (
            joints[:, H36M17.index(name)].astype(np.float64)
            for name in ("l_shoulder", "r_shoulder", "l_hip", "r_hip")
        )
        shoulders = l_shoulder - r_shoulder
        trunk = (l_shoulder + r_shoulder) / 2 - (l_hip + r_hip) / 2
        facing = unit(np.cross(shoulders, trunk))
        left = unit(shoulders)
        R_source_from_body = from_columns(-facing, -left, np.cross(facing, left))
        whole = is_finite(facing) & is_finite(left)
        return np.where(whole[:, None, None], R_source_from_body, np.nan), np.full(len(joints), np.nan)
