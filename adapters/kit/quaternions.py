"""Quaternions of files as rotation matrices. Every file says its order; here it is always w, x, y, z."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.errors import InputError

_UNIT_ERROR = 0.05  # printed with few digits, a unit quaternion is still this near to length 1


def rotations(wxyz: np.ndarray) -> np.ndarray:
    """(T, 3, 3) of unit quaternions (T, 4), NaN where one has a NaN. InputError when their length is not about 1."""
    from scipy.spatial.transform import Rotation

    length = np.linalg.norm(wxyz, axis=-1)
    if (np.abs(length - 1) > _UNIT_ERROR).any():
        row = int(np.argmax(np.abs(np.nan_to_num(length, nan=1.0) - 1)))
        raise InputError(
            "wrong-content",
            f"Expected unit quaternions, got one of length {length[row]:.3g} in row {row}; are these columns angles?",
        )
    R = np.full((len(wxyz), 3, 3), np.nan)
    known = np.isfinite(length)
    R[known] = Rotation.from_quat(np.roll(wxyz[known], -1, axis=-1)).as_matrix()
    return R
