"""Accelerations of wrists and ankles relative to the pelvis, and how far two signals agree: what every report on
accelerations judges by. Both sides are low-passed at 6 Hz without delay (pipeline/signals/filters.py)."""

from __future__ import annotations

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.signals.filters import CUTOFF_HZ, derivative, lowpass

NO_MOTION = "no motion"
PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}


def filtered(path: np.ndarray, time_s: np.ndarray, cutoff_hz: float = CUTOFF_HZ) -> np.ndarray:
    """path (T, J, 3) through the low-pass."""
    return lowpass(path.reshape(len(path), -1), time_s, cutoff_hz).reshape(path.shape)


def velocities(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s of path (T, J, 3) metres without gaps, filtered."""
    return derivative(filtered(path, time_s), time_s)


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps, filtered."""
    return derivative(filtered(path, time_s), time_s, order=2)


def agreement(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Root mean square of a - b, each (...), and their correlation; NaN where one of them does not vary."""
    a, b = a.ravel(), b.ravel()
    rmse = float(np.sqrt(np.mean((a - b) ** 2)))
    moving = min(a.std(), b.std()) > 1e-9
    return rmse, float(np.corrcoef(a, b)[0, 1]) if moving else float("nan")
