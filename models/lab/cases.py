"""Cases of takes: what every report measures and every fit is fitted to, how people count in figures of them, and a few
figures of many values.

Frames of one take err together, and so do takes of one person. So an interval is of people drawn anew; and where
`weights` count, every person has the same, and every take of a person the same within it, however long it is. Errors of
skeletons are of joints (..., T, 17, 3) relative to the pelvis, in the same axes, scaled or turned onto the truth first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ...pipeline.core.rotations import kabsch, rotate
from ..common.metrics import joint_error

_DRAWS = 10_000

K = TypeVar("K")
V = TypeVar("V")
Row = tuple[tuple[str, ...], Any]  # the keys of a place in a report, and one of its values


@dataclass(frozen=True, eq=False)
class Cases:
    """What one take of a person says of one thing: values (N,) by name, of so many cases, such as frames. Of what a run
    states: "error", found less true; "half", half the width of its 90 % bar in the same unit, NaN without one (of a
    length of an error, such as a tilt, "error" is it and "half" its bound); and what the run knows where it states
    this, by which errors are fitted."""

    person: str
    values: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[name]

    def where(self, rows: np.ndarray) -> Cases:
        """Only the cases rows, (N,) bool or their numbers."""
        return Cases(self.person, {name: values[rows] for name, values in self.values.items()})

    def having(self, **values: np.ndarray) -> Cases:
        """With these values too, or in place of those of the same name."""
        return Cases(self.person, {**self.values, **values})

    def judged(self) -> Cases:
        """Only the cases with an error and a bar."""
        return self.where(np.isfinite(self["error"]) & np.isfinite(self["half"]))


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Every value of each key, in order."""
    groups: dict[K, list[V]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def joined(parts: Sequence[Cases]) -> Cases:
    """What one take says of several alike, such as both sides, as one."""
    return Cases(parts[0].person, {name: column(parts, name) for name in parts[0].values})


def column(takes: Sequence[Cases], name: str) -> np.ndarray:
    """(N,) the values by that name of all cases, one take behind the other."""
    return np.concatenate([take[name] for take in takes] or [np.zeros(0)])


def people_of(takes: Sequence[Cases]) -> np.ndarray:
    """(N,) whose each case is."""
    return np.repeat([take.person for take in takes], [len(take) for take in takes])


def weights(takes: Sequence[Cases], use: np.ndarray | None = None) -> np.ndarray:
    """(N,) of all cases, or only of those that a mask (N,) uses: one for a person, shared evenly by their takes that
    have any, and by the cases of each."""
    of_take = np.repeat(np.arange(len(takes)), [len(take) for take in takes])
    use = np.ones(len(of_take), bool) if use is None else use
    people = np.unique([take.person for take in takes], return_inverse=True)[1]
    cases = np.bincount(of_take[use], minlength=len(takes))
    of_person = np.bincount(people[cases > 0], minlength=len(takes))  # takes
    weight = np.zeros(len(of_take))
    weight[use] = 1 / (of_person[people] * cases)[of_take[use]]
    return weight


def quantile(takes: Sequence[Cases], values: np.ndarray, share: float = 0.5) -> float:
    """What a share of the cases stays under, by their `weights`, of values (N,) of them."""
    order = np.argsort(values)
    total = np.cumsum(weights(takes)[order])
    return float(values[order][min(np.searchsorted(total, share * total[-1]), len(values) - 1)])


def figures(takes: Sequence[Cases], by_person: Sequence[str]) -> dict[str, Any]:
    """{name: Figure over all values of all takes}; under "by person" the `pooled` means of these."""
    people = people_of(takes)
    return {
        **{name: Figure.of(column(takes, name)) for name in takes[0].values},
        "by person": {name: pooled(column(takes, name), people) for name in by_person},
    }


def pooled(values: np.ndarray, people: np.ndarray) -> dict[str, Any]:
    """{"mean", "low", "high", "said"} of values (N,), missing ones left out, of people (N,) by name: the mean over all
    values, where it lies in 90 % of draws of as many people, each with all their values, and that in words."""
    known = np.isfinite(values)
    _, of = np.unique(people[known], return_inverse=True)
    low, high = interval(np.bincount(of, weights=values[known]), np.bincount(of).astype(float))
    between = f"{low:.1f} to {high:.1f}" if np.isfinite(low) else "one person"
    said = f"{mean(values):.1f} ({between})" if known.any() else ""
    return {"mean": mean(values), "low": low, "high": high, "said": said}


def interval(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """The 5th and 95th percentile of the mean over people with these sums and counts (N,) of values, drawn N at a time
    with replacement (bootstrap); NaN of fewer than two."""
    if len(sums) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(0).integers(len(sums), size=(_DRAWS, len(sums)))
    low, high = np.quantile(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1), (0.05, 0.95))
    return float(low), float(high)


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


def summed(takes: Sequence[Cases]) -> dict[str, Any]:
    """What a report says of one figure of many takes: {"count", "true": median, "bias": median of found less true,
    "error": Figure of its size, "inside": share of those with a bar}."""
    error, half = column(takes, "error"), column(takes, "half")
    stated = np.isfinite(half)
    return {
        "count": len(error),
        "true": float(np.median(column(takes, "true"))),
        "bias": float(np.median(error)),
        "error": Figure.of(np.abs(error)),
        "inside": float((np.abs(error) <= half)[stated].mean()) if stated.any() else np.nan,
    }
