"""Accelerations of wrists and ankles relative to the pelvis, and how far two signals agree: what every report on
accelerations judges by. Both sides are low-passed at 6 Hz without delay (pipeline/signals/filters.py)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.signals.filters import CUTOFF_HZ, derivative, lowpass
from ...common.metrics import Figure

NO_MOTION = "no motion"
PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}
ALONG = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}
# Of tables: p50 / mean / p95 of RMSE, and p50 of r.
COLUMNS = {
    f"{part}, {direction}": f"{{{part}[{direction}][rmse]:.2f}}; {{{part}[{direction}][r].p50:.2f}}"
    for part in PARTS
    for direction in ALONG
}


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


def compare(signal: np.ndarray, truth: np.ndarray) -> dict[str, tuple[float, float]]:
    """{"vertical", "horizontal": (RMSE, r)} of accelerations (N, J, 3), z up. Horizontal is both axes in one: root
    mean square of an axis, and one correlation."""
    return {name: agreement(signal[..., axes], truth[..., axes]) for name, axes in ALONG.items()}


def over_takes(scores: Sequence[Any]) -> Any:
    """Nested (RMSE, r) of many takes as nested {"rmse", "r": Figure} over takes; {} without any."""
    if not len(scores) or isinstance(scores[0], dict):
        return {key: over_takes([take[key] for take in scores]) for key in (scores[0] if len(scores) else ())}
    rmse, r = np.array(scores).T
    return {"rmse": Figure.of(rmse), "r": Figure.of(r)}
