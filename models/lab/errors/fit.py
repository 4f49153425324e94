"""Bars that hold wherever something is known: the 90 % quantile of the size of an error, by what a run knows.

The quantile is the root of a sum of squares, each a known quantity times a fitted weight, as errors of independent
causes add. It is fitted by quantile regression of the error's logarithm (Koenker and Bassett 1978), with the weights of
judge.py, in all and in every tenth that is judged, so that neither long takes nor large errors nor usual cases decide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from .judge import Stated, tenths

_CASES = 250  # of a take
# Covered of the people of the fit, that judge.COVERED of strangers before other cameras are. By folds of people about
# 0.91 lie inside before the same cameras; other cameras cost about a hundredth.
STRANGERS = 0.915
_SOFT = 0.02  # of the loss's corner, in logarithms
_TINY = 1e-12
_NOTHING = 9.0  # in logarithms, by which a part that is none is smaller than usual squares of errors

Squares = Callable[[Stated], np.ndarray]  # (N, K) what the square of the bar is a weighted sum of


def fitted(takes: Sequence[Stated], squares: Squares, covered: float = STRANGERS) -> np.ndarray:
    """(K,) the weights, none below 0."""
    from scipy.optimize import minimize

    takes = [thinned(take) for take in takes]
    x = np.concatenate([squares(take) for take in takes])
    error = np.log(np.abs(np.concatenate([take.error for take in takes])) + _TINY)
    weight = np.mean([each / each.sum() for each in _weights(takes)], axis=0)
    size = np.average(error, weights=weight)
    error = error - size  # so that a part is as small in any unit
    usual = np.average(x, axis=0, weights=weight) + _TINY
    x = x / usual

    def loss(logs: np.ndarray) -> tuple[float, np.ndarray]:
        parts = x * np.exp(logs)
        total = parts.sum(axis=1) + _TINY
        over = error - 0.5 * np.log(total)
        soft = np.logaddexp(0, over / _SOFT) * _SOFT  # max(over, 0), with a round corner
        value = weight @ (soft - (1 - covered) * over)
        slope = 1 / (1 + np.exp(-np.clip(over / _SOFT, -50, 50))) - (1 - covered)
        return float(value), -0.5 * ((weight * slope / total) @ parts)

    start = np.full(x.shape[1], np.log(3 / x.shape[1]))
    logs = minimize(loss, start, jac=True, method="L-BFGS-B", bounds=[(-12, 12)] * len(start)).x
    return np.where(logs < -_NOTHING, 0.0, np.exp(logs + 2 * size)) / usual


def _weights(takes: Sequence[Stated]) -> Iterator[np.ndarray]:
    """(N,) of the cases of all takes, as judge.inside weighs them; and of the cases of every tenth that is judged."""
    of_take = np.repeat(np.arange(len(takes)), [len(take.error) for take in takes])
    people = np.unique([take.person for take in takes], return_inverse=True)[1]
    every = np.ones(len(of_take), bool)
    for use in (every, *(use for name in takes[0].known for *_, use in tenths(takes, name))):
        cases = np.bincount(of_take[use], minlength=len(takes))
        of_person = np.bincount(people[cases > 0], minlength=len(takes))  # takes
        weight = np.zeros(len(of_take))
        weight[use] = 1 / (of_person[people] * cases)[of_take[use]]
        yield weight


def with_bars(take: Stated, squares: Squares, found: np.ndarray) -> Stated:
    """The take with the bars that weights found (K,) give."""
    return replace(take, half=np.sqrt(squares(take) @ found))


def held_out(
    by_group: Mapping[str, Sequence[Stated]], squares: Squares, covered: float = STRANGERS
) -> dict[str, list[Stated]]:
    """Each person's takes with the bars that those of all the others ask for, of all groups together; by group."""
    takes = [take for group in by_group.values() for take in group]
    out: dict[str, list[Stated]] = {name: [] for name in by_group}
    for person in sorted({take.person for take in takes}):
        found = fitted([take for take in takes if take.person != person], squares, covered)
        for name, group in by_group.items():
            out[name] += [with_bars(take, squares, found) for take in group if take.person == person]
    return out


def thinned(take: Stated) -> Stated:
    """At most _CASES of it, drawn: every tenth would be of the same joint."""
    rows = np.sort(np.random.default_rng(0).permutation(len(take.error))[:_CASES])
    return take.part(rows)
