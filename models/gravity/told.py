"""What a user or a sensor tells about up."""

from __future__ import annotations

import numpy as np

from ...pipeline.errors import InputError
from ...pipeline.pose import TOLD_UP
from ..synthetic.cameras import view_rotation
from .evidence import Evidence, direction

_GRAVITY, _ANGLES = TOLD_UP
_TOLD_DEG = 1.0  # error of a camera's pitch, roll or gravity vector that the user states


def told_up(
    gravity: tuple[float, float, float] | None, pitch_deg: float | None, roll_deg: float | None
) -> list[Evidence]:
    """What is told as evidence on up; none where nothing is. gravity: which way things fall, in the camera's axes (x
    right, y down, z away), any length. pitch_deg, roll_deg: of the camera, positive when it looks down, and when the
    image's content turns counter-clockwise; both or neither, for an angle that nobody told is not 0. InputError for
    what is no direction, for one angle alone, and for a camera that is told twice how it leans."""
    if gravity is not None and (pitch_deg is not None or roll_deg is not None):
        raise InputError("Expected the camera's gravity, or its pitch and roll, not both.")
    if gravity is not None:
        falls = np.array(gravity, dtype=np.float64)
        if not np.isfinite(falls).all() or not np.linalg.norm(falls) > 0:
            raise InputError(
                f"Expected a direction for gravity, such as 0,1,0 (down the picture), got {gravity}."
            )
        return [direction(_GRAVITY, -falls, _TOLD_DEG)]
    if pitch_deg is None and roll_deg is None:
        return []
    if not all(angle is None or abs(angle) <= 180 for angle in (pitch_deg, roll_deg)):
        raise InputError(f"Expected pitch and roll in degrees, got {pitch_deg} and {roll_deg}.")
    if pitch_deg is None or roll_deg is None:
        alone = "roll" if pitch_deg is None else "pitch"
        raise InputError(
            f"Expected the camera's pitch and roll together, got the {alone} alone; a camera that looks neither up nor "
            "down has --pitch 0, one whose pictures show the horizon level --roll 0."
        )
    angles = (np.array(angle, dtype=np.float64) for angle in (0.0, pitch_deg, roll_deg))
    return [direction(_ANGLES, view_rotation(*angles)[:, 2], _TOLD_DEG)]
