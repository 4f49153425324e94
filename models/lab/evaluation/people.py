"""Figures over people: every person has one weight, and every take one within its person's."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

_DRAWS = 10_000
_SEED = 0  # of the bootstrap


def mean(values: np.ndarray) -> float:
    """Of values (N,), missing ones left out; NaN without any."""
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def means(rows: Sequence[np.ndarray]) -> np.ndarray:
    """(F,) the mean of every column of rows (F,)."""
    return np.array([mean(column) for column in np.stack(rows).T])


def by_person(takes: Iterable[tuple[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """{person: (F,)} the mean over each person's takes, given as (person, (F,))."""
    of: dict[str, list[np.ndarray]] = {}
    for person, values in takes:
        of.setdefault(person, []).append(values)
    return {person: means(rows) for person, rows in of.items()}


def interval(values: np.ndarray) -> tuple[float, float]:
    """The 5th and 95th percentile of the mean of people's values (N,) drawn N at a time with replacement (bootstrap);
    NaN of fewer than two."""
    if len(values) < 2:
        return float("nan"), float("nan")
    drawn = np.random.default_rng(_SEED).integers(len(values), size=(_DRAWS, len(values)))
    low, high = np.quantile(values[drawn].mean(axis=1), (0.05, 0.95))
    return float(low), float(high)
