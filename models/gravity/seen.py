"""One person's frames: a rectifier's answer and where it comes from, and means over neighbouring frames: a Gaussian in
time, weighted by trust, within a clip."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .votes import expected_deg


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


def trust(error_deg: np.ndarray | float) -> np.ndarray:
    """(...,) a frame's weight, 1 / error^2."""
    return 1 / expected_deg(error_deg) ** 2


def smoothed(values: np.ndarray, weights: np.ndarray, seen: Seen, std_s: float) -> np.ndarray:
    """(T, D) mean of values (T, D) of a person's frames, with weights (T,) times a Gaussian in time, within each part
    between clip boundaries; NaN where no weight is near."""
    out = np.full(values.shape, np.nan)
    for start, end in pairwise([0, *seen.seams, len(values)]):
        part = slice(start, end)
        out[part] = _smoothed(values[part], weights[part], seen.time_s[part], std_s)
    return out


def _smoothed(values: np.ndarray, weights: np.ndarray, time_s: np.ndarray, std_s: float) -> np.ndarray:
    total = weights[:, None] * values
    mass = weights.copy()
    for shift in range(1, len(values)):
        near = np.exp(-(((time_s[shift:] - time_s[:-shift]) / std_s) ** 2) / 2)
        if near.max() < 1e-3:
            break
        for here, there in (
            (slice(shift, None), slice(None, -shift)),
            (slice(None, -shift), slice(shift, None)),
        ):
            mass[here] += near * weights[there]
            total[here] += (near * weights[there])[:, None] * values[there]
    return total / np.where(mass > 1e-9, mass, np.nan)[:, None]
