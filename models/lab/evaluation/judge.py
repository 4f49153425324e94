"""One procedure for every stated error: how many lie inside, person by person, and what would make them hold.

That is a factor on the bars, or bars that hold wherever something is known: the 90 % quantile of the size of an error,
by what a run knows. That quantile is the root of a sum of squares, each a known quantity times a fitted weight, as
errors of independent causes add. It is fitted by quantile regression of the error's logarithm (Koenker and Bassett
1978), with the weights of common/cases.py, in all and in every tenth of the cases, so that neither long takes nor large
errors nor usual cases decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ..common.cases import Cases, column, interval, people_of, quantile, weights
from ..common.metrics import Figure, by_person, mean

COVERED = 0.9  # what "90 %" states
_BINS = 10
_FEWEST_PEOPLE = 3  # of a tenth
_CASES = 250  # of a take
# Covered of the people of the fit, that COVERED of strangers before other cameras are. By folds of people about
# 0.91 lie inside before the same cameras; other cameras cost about a hundredth.
STRANGERS = 0.915
_SOFT = 0.02  # of the loss's corner, in logarithms
_TINY = 1e-12
_NOTHING = 9.0  # in logarithms, by which a part that is none is smaller than usual squares of errors

Squares = Callable[[Cases], np.ndarray]  # (N, K) what the square of the bar is a weighted sum of


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


def inside(takes: Sequence[Cases]) -> dict[str, Any]:
    """{"cases", "people", "inside": the share of cases within their bars, "low", "high": the 90 % interval of that
    share over people like these}, of takes that are judged (Cases.judged)."""
    shares = by_person(
        (take.person, np.array([np.mean(np.abs(take["error"]) <= take["half"])]))
        for take in takes
        if len(take)
    )
    of_people = np.array([share for (share,) in shares.values()])
    low, high = interval(of_people, np.ones(len(of_people)))
    share = {"inside": mean(of_people), "low": low, "high": high}
    return {"cases": sum(map(len, takes)), "people": len(of_people), **share}


def factor(takes: Sequence[Cases], covered: float = COVERED) -> float:
    """What to multiply the bars by so that `covered` of the cases are inside: the quantile of |error| over bar."""
    return quantile(takes, np.abs(column(takes, "error")) / column(takes, "half"), covered)


def _tenths(takes: Sequence[Cases], name: str) -> Iterator[np.ndarray]:
    """(N,) bool of the cases of all takes that are in a tenth of them by what is known under `name`, of every tenth but
    those of too few people; of postures each by itself, however few they are."""
    values, people = column(takes, name), people_of(takes)
    if len(values) < _BINS:
        return
    if name == "posture":
        yield from (values == which for which in np.unique(values[np.isfinite(values)]))
        return
    edges = np.unique(np.nanquantile(values, np.linspace(0, 1, _BINS + 1)))
    for low, high in pairwise(edges):
        use = (values >= low) & ((values <= high) if high == edges[-1] else (values < high))
        if len(np.unique(people[use])) >= _FEWEST_PEOPLE:
            yield use


def fitted(takes: Sequence[Cases], squares: Squares) -> np.ndarray:
    """(K,) the weights, none below 0, by which STRANGERS of the cases are inside."""
    from scipy.optimize import minimize

    takes = [thinned(take) for take in takes]
    x = np.concatenate([squares(take) for take in takes])
    error = np.log(np.abs(column(takes, "error")) + _TINY)
    known = [name for name in takes[0].values if name not in ("error", "half")]
    parts = [None, *(use for name in known for use in _tenths(takes, name))]
    weight = np.mean([each / each.sum() for each in (weights(takes, use) for use in parts)], axis=0)
    size = np.average(error, weights=weight)
    error = error - size  # so that a part is as small in any unit
    usual = np.average(x, axis=0, weights=weight) + _TINY
    x = x / usual

    def loss(logs: np.ndarray) -> tuple[float, np.ndarray]:
        parts = x * np.exp(logs)
        total = parts.sum(axis=1) + _TINY
        over = error - 0.5 * np.log(total)
        soft = np.logaddexp(0, over / _SOFT) * _SOFT  # max(over, 0), with a round corner
        value = weight @ (soft - (1 - STRANGERS) * over)
        slope = 1 / (1 + np.exp(-np.clip(over / _SOFT, -50, 50))) - (1 - STRANGERS)
        return float(value), -0.5 * ((weight * slope / total) @ parts)

    start = np.full(x.shape[1], np.log(3 / x.shape[1]))
    logs = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[(-12, 12)] * len(start)).x
    return np.where(logs < -_NOTHING, 0.0, np.exp(logs + 2 * size)) / usual


def held_out(by_group: Mapping[str, Sequence[Cases]], squares: Squares) -> dict[str, list[Cases]]:
    """Each person's takes with the bars that those of all the others ask for, of all groups together; by group."""
    takes = [take for group in by_group.values() for take in group]
    out: dict[str, list[Cases]] = {name: [] for name in by_group}
    for person in sorted({take.person for take in takes}):
        found = fitted([take for take in takes if take.person != person], squares)
        for name, group in by_group.items():
            own = (take for take in group if take.person == person)
            out[name] += [take.having(half=np.sqrt(squares(take) @ found)) for take in own]
    return out


def thinned(take: Cases) -> Cases:
    """At most _CASES of it, drawn: every tenth would be of the same joint."""
    rows = np.sort(np.random.default_rng(0).permutation(len(take))[:_CASES])
    return take.where(rows)
