"""What a user or a sensor tells about up."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.camera import view_rotation
from ...pipeline.core.pose import TOLD_UP
from ...pipeline.core.take import Told
from .evidence import Evidence, direction

_GRAVITY, _ANGLES = TOLD_UP
_TOLD_DEG = 1.0  # error of a camera's pitch, roll or gravity vector that the user states


def told_up(told: Told) -> list[Evidence]:
    """What is told of gravity, or of the camera's pitch and roll, as evidence on up; none where nothing is."""
    if told.gravity is not None:
        return [direction(_GRAVITY, -np.array(told.gravity, dtype=np.float64), _TOLD_DEG)]
    if told.pitch_deg is None or told.roll_deg is None:
        return []
    angles = (np.array(angle, dtype=np.float64) for angle in (0.0, told.pitch_deg, told.roll_deg))
    return [direction(_ANGLES, view_rotation(*angles)[:, 2], _TOLD_DEG)]
