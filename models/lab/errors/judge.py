"""One procedure for every stated error: how many lie inside, person by person, and the factor with which they would.

Every person counts the same, and every take of a person the same within it, however long it is: frames of one take err
together, and so do takes of one person.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from ..evaluation.people import by_person, interval

COVERED = 0.9  # what "90 %" states
_BINS = 10
_FEWEST_PEOPLE = 3  # of a bin that is judged


@dataclass(frozen=True, eq=False)
class Stated:
    """What one take states of one thing. error: (N,) found less true. half: (N,) half the width of its 90 % bar, in
    the same unit; for a length of an error (a tilt), `error` is it and `half` its bound. known: {name: (N,)} what a run
    knows where it states this, for bins."""

    statement: str
    person: str
    error: np.ndarray
    half: np.ndarray
    known: Mapping[str, np.ndarray] = field(default_factory=dict)

    def judged(self) -> Stated:
        """Only the cases with an error and a bar."""
        return self.part(np.isfinite(self.error) & np.isfinite(self.half))

    def part(self, rows: np.ndarray) -> Stated:
        """Only the cases rows, (N,) bool or their numbers."""
        known = {name: values[rows] for name, values in self.known.items()}
        return replace(self, error=self.error[rows], half=self.half[rows], known=known)


@dataclass(frozen=True)
class Inside:
    """The share of cases within their bars, and the 90 % interval of that share over people like these."""

    cases: int
    people: int
    inside: float
    low: float
    high: float


def inside(takes: Sequence[Stated], factor: float = 1.0) -> Inside:
    """Of takes that are judged (Stated.judged), their bars times `factor`."""
    shares = by_person(
        (take.person, np.atleast_1d(_share(take, factor))) for take in takes if len(take.error)
    )
    if not shares:
        return Inside(0, 0, float("nan"), float("nan"), float("nan"))
    of_people = np.concatenate(list(shares.values()))
    low, high = interval(of_people)
    return Inside(sum(len(take.error) for take in takes), len(shares), float(of_people.mean()), low, high)


def _share(take: Stated, factor: float) -> float:
    return float(np.mean(np.abs(take.error) <= factor * take.half))


def bins(takes: Sequence[Stated], name: str) -> list[tuple[float, float, float, Inside]]:
    """(from, to, mean error, Inside) in tenths of the cases by what is known under `name`; those of too few people are
    left out."""
    out = []
    for low, high, use in tenths(takes, name):
        ends = np.cumsum([len(take.error) for take in takes])[:-1]
        part = [take.part(of) for take, of in zip(takes, np.split(use, ends), strict=True) if of.any()]
        out.append((low, high, mean(part, lambda take: take.error), inside(part)))
    return out


def tenths(takes: Sequence[Stated], name: str) -> Iterator[tuple[float, float, np.ndarray]]:
    """(from, to, (N,) bool of the cases of all takes) of every tenth of the cases by what is known under `name`, but
    those of too few people; of postures each by itself, however few they are."""
    values = np.concatenate([take.known[name] for take in takes] or [np.zeros(0)])
    if len(values) < _BINS:
        return
    people = np.unique([take.person for take in takes], return_inverse=True)[1]
    of_case = np.repeat(people, [len(take.error) for take in takes])
    if name == "posture":
        for which in np.unique(values).tolist():
            yield which, which, values == which
        return
    edges = np.unique(np.nanquantile(values, np.linspace(0, 1, _BINS + 1)))
    for low, high in pairwise(edges):
        use = (values >= low) & ((values <= high) if high == edges[-1] else (values < high))
        if len(np.unique(of_case[use])) >= _FEWEST_PEOPLE:
            yield float(low), float(high), use


def factor(takes: Sequence[Stated], covered: float = COVERED) -> float:
    """What to multiply the bars by so that `covered` of the cases are inside: the quantile of |error| over bar."""
    return quantile(takes, lambda take: np.abs(take.error) / take.half, covered)


def quantile(takes: Sequence[Stated], of: Callable[[Stated], np.ndarray], share: float = 0.5) -> float:
    """What a share of the cases stays under, of any value of them (N,)."""
    values = np.concatenate([of(take) for take in takes])
    order = np.argsort(values)
    total = np.cumsum(weights(takes)[order])
    return float(values[order][min(np.searchsorted(total, share * total[-1]), len(values) - 1)])


def weights(takes: Sequence[Stated]) -> np.ndarray:
    """(N,) of the cases of all takes: one for a person, shared evenly by their takes, and by the cases of each."""
    count: dict[str, int] = {}
    for take in takes:
        count[take.person] = count.get(take.person, 0) + 1
    parts = [np.full(len(take.error), 1 / (count[take.person] * max(len(take.error), 1))) for take in takes]
    return np.concatenate(parts or [np.zeros(0)])


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
    )
