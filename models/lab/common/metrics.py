"""Errors of many frames, takes and people in a few figures, every person with one weight and every take one within its
person's; and errors that scale or turn what is judged onto the truth, of joints (..., T, 17, 3) relative to the
pelvis, in the same axes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import kabsch, rotate
from ...common.metrics import joint_error, relative

_DRAWS = 10_000
_SEED = 0  # of the bootstrap


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


def person_size(joints: np.ndarray) -> float:
    """Root mean square distance of joints (T, 17, 3) from the pelvis, which does not count itself, in their unit; NaN
    without any."""
    square = (np.delete(relative(joints), H36M17.index("pelvis"), axis=-2) ** 2).sum(axis=-1)
    square = square[np.isfinite(square)]
    return float(np.sqrt(square.mean())) if len(square) else float("nan")


def scaled(predicted: np.ndarray, truth: np.ndarray, per: str = "frame") -> np.ndarray:
    """predicted (..., T, 17, 3) times the one factor that brings it closest to truth, per "frame" or per "take"
    (T frames)."""
    axes = (-2, -1) if per == "frame" else (-3, -2, -1)
    valid = np.isfinite(predicted)
    dot = np.sum(predicted * truth, axis=axes, where=valid, keepdims=True)
    square = np.sum(predicted**2, axis=axes, where=valid, keepdims=True)
    return predicted * (dot / np.where(square > 0, square, np.nan))


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


@dataclass(frozen=True, eq=False)
class OfTake:
    """What a report measured of a take of a person: by figure values (N,), such as one a frame."""

    person: str
    values: Mapping[str, np.ndarray]

    def where(self, use: np.ndarray) -> OfTake:
        """Those of a mask (N,) alone."""
        return OfTake(self.person, {name: values[use] for name, values in self.values.items()})


def every_value(takes: Sequence[OfTake]) -> dict[str, np.ndarray]:
    """{figure: (N,)} of all takes."""
    return {name: np.concatenate([take.values[name] for take in takes]) for name in takes[0].values}


def figures(takes: Sequence[OfTake], by_person: Sequence[str]) -> dict[str, Any]:
    """{figure: Figure over all values of all takes}; under "by person" the `pooled` means of these."""
    values = every_value(takes)
    people = np.repeat(
        [take.person for take in takes], [len(next(iter(take.values.values()))) for take in takes]
    )
    return {
        **{name: Figure.of(of) for name, of in values.items()},
        "by person": {name: pooled(values[name], people) for name in by_person},
    }


Row = tuple[tuple[str, ...], Any]  # the keys of a place in a report, and one of its values


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


def pooled(values: np.ndarray, people: Sequence[str] | np.ndarray) -> dict[str, Any]:
    """{"mean", "low", "high", "said"} of values (N,), missing ones left out, of people (N,) by name: the mean over all
    values, where it lies in 90 % of draws of as many people, each with all their values, and that in words."""
    known = np.isfinite(values)
    _, of = np.unique(np.asarray(people)[known], return_inverse=True)
    low, high = interval(np.bincount(of, weights=values[known]), np.bincount(of).astype(float))
    between = f"{low:.1f} to {high:.1f}" if np.isfinite(low) else "one person"
    said = f"{mean(values):.1f} ({between})" if known.any() else ""
    return {"mean": mean(values), "low": low, "high": high, "said": said}


def interval(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """The 5th and 95th percentile of the mean over people with these sums and counts (N,) of values, drawn N at a time
    with replacement (bootstrap); NaN of fewer than two."""
    if len(sums) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(_SEED).integers(len(sums), size=(_DRAWS, len(sums)))
    low, high = np.quantile(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1), (0.05, 0.95))
    return float(low), float(high)
