"""What one person's frames are to everything that levels them: a rectifier's answer and where it comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Seen:
    """One person before a camera, as a rectifier sees them, in the camera's axes.

    joints: (T, 17, 3) relative to the pelvis, any unit. R_camera_from_body: (T, 3, 3), NaN where a frame has too few
    torso joints. error_deg: (T,) expected rotation error of each, NaN where unknown. time_s: (T,) increasing. seams:
    rows that no smoothing crosses. root: (T, 3) the pelvis's own path where it is known, in the same unit. name: how
    shares name the person among several. spread: (T,) the lifter's stated error (models/common/spread.py), NaN or None
    where it states none.
    """

    joints: np.ndarray
    R_camera_from_body: np.ndarray
    error_deg: np.ndarray
    time_s: np.ndarray
    seams: tuple[int, ...] = ()
    root: np.ndarray | None = None
    name: str = "person"
    spread: np.ndarray | None = None

    @property
    def votes(self) -> np.ndarray:
        """(T, 3) unit, each frame's own up; NaN where it has none."""
        return self.R_camera_from_body[:, :, 2]
