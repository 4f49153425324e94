"""One procedure for every stated error: how many lie inside, person by person, and what would make them hold.

Every person counts the same, and every take of a person the same within it, however long it is: frames of one take err
together, and so do takes of one person. What makes them hold is a factor on the bars, or bars that hold wherever
something is known: the 90 % quantile of the size of an error, by what a run knows. That quantile is the root of a sum
of squares, each a known quantity times a fitted weight, as errors of independent causes add. It is fitted by quantile
regression of the error's logarithm (Koenker and Bassett 1978), with the same weights, in all and in every tenth of the
cases, so that neither long takes nor large errors nor usual cases decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ....pipeline.core.measures import SD_90
from ..common.metrics import Figure, by_person, interval

COVERED = 0.9  # what "90 %" states
_BINS = 10
BINS = ("posture", "speed")  # known of every case of a take with bodies, that all are judged apart by
_FEWEST_PEOPLE = 3  # of a tenth
_CASES = 250  # of a take
# Covered of the people of the fit, that COVERED of strangers before other cameras are. By folds of people about
# 0.91 lie inside before the same cameras; other cameras cost about a hundredth.
STRANGERS = 0.915
_SOFT = 0.02  # of the loss's corner, in logarithms
_TINY = 1e-12
_NOTHING = 9.0  # in logarithms, by which a part that is none is smaller than usual squares of errors


@dataclass(frozen=True, eq=False)
class Stated:
    """What one take states of one thing. error: (N,) found less true. half: (N,) half the width of its 90 % bar, in
    the same unit, NaN without one; for a length of an error (a tilt), `error` is it and `half` its bound. known:
    {name: (N,)} what a run knows where it states this, of errors that are fitted by it. true: (N,) of a figure."""

    statement: str
    person: str
    error: np.ndarray
    half: np.ndarray
    known: Mapping[str, np.ndarray] = field(default_factory=dict)
    true: np.ndarray | None = None

    def judged(self) -> Stated:
        """Only the cases with an error and a bar."""
        return self.part(np.isfinite(self.error) & np.isfinite(self.half))

    def part(self, rows: np.ndarray) -> Stated:
        """Only the cases rows, (N,) bool or their numbers."""
        known = {name: values[rows] for name, values in self.known.items()}
        true = None if self.true is None else self.true[rows]
        return replace(self, error=self.error[rows], half=self.half[rows], known=known, true=true)


Squares = Callable[[Stated], np.ndarray]  # (N, K) what the square of the bar is a weighted sum of


def bar(error: float | None) -> float:
    """Half the width of the 90 % bar of a standard deviation; NaN where none is stated."""
    return float("nan") if error is None else SD_90 * error


def by_statement(stated: Iterable[Stated]) -> dict[str, list[Stated]]:
    """Those with a case."""
    found: dict[str, list[Stated]] = {}
    for each in stated:
        if len(each.error):
            found.setdefault(each.statement, []).append(each)
    return found


def summed(takes: Sequence[Stated]) -> dict[str, Any]:
    """What a report says of one figure of many takes: {"count", "true": median, "bias": median of found less true,
    "error": Figure of its size, "inside": share of those with a bar}."""
    error, half, true = (
        np.concatenate([getattr(take, name) for take in takes]) for name in ("error", "half", "true")
    )
    stated = np.isfinite(half)
    return {
        "count": len(error),
        "true": float(np.median(true)),
        "bias": float(np.median(error)),
        "error": Figure.of(np.abs(error)),
        "inside": float((np.abs(error) <= half)[stated].mean()) if stated.any() else np.nan,
    }


@dataclass(frozen=True)
class Inside:
    """The share of cases within their bars, and the 90 % interval of that share over people like these."""

    cases: int
    people: int
    inside: float
    low: float
    high: float


def inside(takes: Sequence[Stated]) -> Inside:
    """Of takes that are judged (Stated.judged)."""
    shares = by_person(
        (take.person, np.array([np.mean(np.abs(take.error) <= take.half)]))
        for take in takes
        if len(take.error)
    )
    if not shares:
        return Inside(0, 0, float("nan"), float("nan"), float("nan"))
    of_people = np.concatenate(list(shares.values()))
    low, high = interval(of_people, np.ones(len(of_people)))
    return Inside(sum(len(take.error) for take in takes), len(shares), float(of_people.mean()), low, high)


def _tenths(takes: Sequence[Stated], name: str) -> Iterator[np.ndarray]:
    """(N,) bool of the cases of all takes that are in a tenth of them by what is known under `name`, of every tenth but
    those of too few people; of postures each by itself, however few they are."""
    values = np.concatenate([take.known[name] for take in takes] or [np.zeros(0)])
    if len(values) < _BINS:
        return
    people = np.unique([take.person for take in takes], return_inverse=True)[1]
    of_case = np.repeat(people, [len(take.error) for take in takes])
    if name == "posture":
        yield from (values == which for which in np.unique(values[np.isfinite(values)]))
        return
    edges = np.unique(np.nanquantile(values, np.linspace(0, 1, _BINS + 1)))
    for low, high in pairwise(edges):
        use = (values >= low) & ((values <= high) if high == edges[-1] else (values < high))
        if len(np.unique(of_case[use])) >= _FEWEST_PEOPLE:
            yield use


def factor(takes: Sequence[Stated], covered: float = COVERED) -> float:
    """What to multiply the bars by so that `covered` of the cases are inside: the quantile of |error| over bar."""
    return quantile(takes, lambda take: np.abs(take.error) / take.half, covered)


def quantile(takes: Sequence[Stated], of: Callable[[Stated], np.ndarray], share: float = 0.5) -> float:
    """What a share of the cases stays under, of any value of them (N,)."""
    values = np.concatenate([of(take) for take in takes])
    order = np.argsort(values)
    total = np.cumsum(weights(takes)[order])
    return float(values[order][min(np.searchsorted(total, share * total[-1]), len(values) - 1)])


def weights(takes: Sequence[Stated], use: np.ndarray | None = None) -> np.ndarray:
    """(N,) of the cases of all takes, or only of those that a mask (N,) uses: one for a person, shared evenly by their
    takes that have any, and by the cases of each."""
    of_take = np.repeat(np.arange(len(takes)), [len(take.error) for take in takes])
    use = np.ones(len(of_take), bool) if use is None else use
    people = np.unique([take.person for take in takes], return_inverse=True)[1]
    cases = np.bincount(of_take[use], minlength=len(takes))
    of_person = np.bincount(people[cases > 0], minlength=len(takes))  # takes
    weight = np.zeros(len(of_take))
    weight[use] = 1 / (of_person[people] * cases)[of_take[use]]
    return weight


def mean(takes: Sequence[Stated], of: Callable[[Stated], np.ndarray]) -> float:
    """The mean over the cases of any value of them (N,)."""
    return float(np.average(np.concatenate([of(take) for take in takes]), weights=weights(takes)))


def joined(parts: Sequence[Stated]) -> Stated:
    """What one take states of several alike, such as both sides, as one."""
    first = parts[0]
    return replace(
        first,
        error=np.concatenate([part.error for part in parts]),
        half=np.concatenate([part.half for part in parts]),
        known={name: np.concatenate([part.known[name] for part in parts]) for name in first.known},
        true=None,
    )


def fitted(takes: Sequence[Stated], squares: Squares, on_top: bool = False) -> np.ndarray:
    """(K,) the weights, none below 0, by which STRANGERS of the cases are inside; on_top: beside the bars that are."""
    from scipy.optimize import minimize

    takes = [thinned(take) for take in takes]
    x = np.concatenate([squares(take) for take in takes])
    own = np.concatenate([on_top * take.half**2 for take in takes])
    error = np.log(np.abs(np.concatenate([take.error for take in takes])) + _TINY)
    parts = [None, *(use for name in takes[0].known for use in _tenths(takes, name))]
    weight = np.mean([each / each.sum() for each in (weights(takes, use) for use in parts)], axis=0)
    size = np.average(error, weights=weight)
    error = error - size  # so that a part is as small in any unit
    usual = np.average(x, axis=0, weights=weight) + _TINY
    x, own = x / usual, own / np.exp(2 * size)

    def loss(logs: np.ndarray) -> tuple[float, np.ndarray]:
        parts = x * np.exp(logs)
        total = parts.sum(axis=1) + own + _TINY
        over = error - 0.5 * np.log(total)
        soft = np.logaddexp(0, over / _SOFT) * _SOFT  # max(over, 0), with a round corner
        value = weight @ (soft - (1 - STRANGERS) * over)
        slope = 1 / (1 + np.exp(-np.clip(over / _SOFT, -50, 50))) - (1 - STRANGERS)
        return float(value), -0.5 * ((weight * slope / total) @ parts)

    start = np.full(x.shape[1], np.log(3 / x.shape[1]))
    logs = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[(-12, 12)] * len(start)).x
    return np.where(logs < -_NOTHING, 0.0, np.exp(logs + 2 * size)) / usual


def held_out(
    by_group: Mapping[str, Sequence[Stated]], squares: Squares, on_top: bool = False
) -> dict[str, list[Stated]]:
    """Each person's takes with the bars that those of all the others ask for, of all groups together; by group."""
    takes = [take for group in by_group.values() for take in group]
    out: dict[str, list[Stated]] = {name: [] for name in by_group}
    for person in sorted({take.person for take in takes}):
        found = fitted([take for take in takes if take.person != person], squares, on_top)
        for name, group in by_group.items():
            own = (take for take in group if take.person == person)
            bars = ((take, on_top * take.half**2 + squares(take) @ found) for take in own)
            out[name] += [replace(take, half=np.sqrt(bar)) for take, bar in bars]
    return out


def thinned(take: Stated) -> Stated:
    """At most _CASES of it, drawn: every tenth would be of the same joint."""
    rows = np.sort(np.random.default_rng(0).permutation(len(take.error))[:_CASES])
    return take.part(rows)
