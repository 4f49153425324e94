"""Errors of skeletons that are scaled or turned onto the truth first, of joints (..., T, 17, 3) relative to the pelvis,
in the same axes; and a few figures of many values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ....pipeline.core.rotations import kabsch, rotate
from ...common.metrics import joint_error


@dataclass(frozen=True)
class Figure:
    """Percentiles and mean over frames, or over takes (of each take's mean)."""

    p50: float
    mean: float
    p95: float

    @classmethod
    def of(cls, values: np.ndarray) -> Figure:
        values = values[np.isfinite(values)]
        if len(values) == 0:
            return cls(np.nan, np.nan, np.nan)
        return cls(*(float(v) for v in (np.median(values), values.mean(), np.quantile(values, 0.95))))


def scaled(predicted: np.ndarray, truth: np.ndarray, per: str = "frame") -> np.ndarray:
    """predicted (..., T, 17, 3) times the one factor that brings it closest to truth, `scale_of`."""
    return predicted * scale_of(predicted, truth, per)


def scale_of(predicted: np.ndarray, truth: np.ndarray, per: str = "frame") -> np.ndarray:
    """(..., T, 1, 1) that factor per "frame", or (..., 1, 1, 1) per "take" (T frames)."""
    axes = (-2, -1) if per == "frame" else (-3, -2, -1)
    valid = np.isfinite(predicted)
    dot = np.sum(predicted * truth, axis=axes, where=valid, keepdims=True)
    square = np.sum(predicted**2, axis=axes, where=valid, keepdims=True)
    return dot / np.where(square > 0, square, np.nan)


def procrustes_error(predicted: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """(..., T) the same with the best scale of every frame too (PA-MPJPE)."""
    a = truth - truth.mean(axis=-2, keepdims=True)
    b = predicted - predicted.mean(axis=-2, keepdims=True)
    return joint_error(scaled(rotate(kabsch(a, b), b), a), a)


def sorting(expected: np.ndarray, true: np.ndarray) -> float:
    """Spearman's rank correlation of expected and true errors (N,), where both are known; NaN where all are alike."""
    from scipy.stats import spearmanr

    both = np.isfinite(expected) & np.isfinite(true)
    if not both.any() or np.ptp(expected[both]) == 0:
        return float("nan")
    return float(spearmanr(expected[both], true[both])[0])  # type: ignore[arg-type]


def mean(values: np.ndarray) -> float:
    """Of values (N,), missing ones left out; NaN without any."""
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def by_person(takes: Iterable[tuple[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """{person: (F,)} the mean over each person's takes, given as (person, (F,))."""
    of: dict[str, list[np.ndarray]] = {}
    for person, values in takes:
        of.setdefault(person, []).append(values)
    return {person: np.array([mean(column) for column in np.stack(rows).T]) for person, rows in of.items()}
