"""The same person under the same name from frame to frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .protocols import Found
from .yolox import overlap

_REACH = 0.5  # of the body's size: how far a person's joints may have moved, on average, since last seen
_MEMORY = 30  # frames after which somebody who was lost counts as a new person
_NEVER = 1e6


@dataclass(frozen=True, eq=False)
class Sighting:
    """Where a person was seen last."""

    person: int
    frame: int
    found: Found


class Tracker:
    """Names people 0, 1, ... in order of appearance.

    Each frame's people are joined to those of the last 30 frames, all at once, so that the sum of distances is the
    least (Hungarian method). The distance is that of the joints, weighted by their scores, over the body's size, and
    must stay below half of it; less the part that the boxes share.
    """

    def __init__(self, last: Sequence[Sighting] = (), people: int = 0) -> None:
        """last: of everybody who may come back, in order of time, and people: how many there were so far; to go on."""
        self._last, self._people = list(last), people

    def names(self, frame: int, people: Sequence[Found]) -> list[int]:
        """The name of each person of a frame; frames come in order."""
        known = [seen for seen in self._last if frame - seen.frame <= _MEMORY]
        names = [-1] * len(people)
        if known and people:
            cost = np.array([[_cost(seen.found, person) for person in people] for seen in known])
            for row, column in _pairs(cost):
                if cost[row, column] < _NEVER:
                    names[column] = known[row].person
        for i, name in enumerate(names):
            if name < 0:
                names[i], self._people = self._people, self._people + 1
        here = [Sighting(name, frame, person) for name, person in zip(names, people, strict=True)]
        self._last = [seen for seen in known if seen.person not in names] + here
        return names

    def cut(self) -> None:
        """What follows shows something else: nobody is who was there before."""
        self._last = []


def _pairs(cost: np.ndarray) -> list[tuple[int, int]]:
    """Rows and columns of cost (N, M), each at most once, whose sum is the least."""
    if 1 in cost.shape:  # one person: without an import that takes half a second
        row, column = np.unravel_index(int(cost.argmin()), cost.shape)
        return [(int(row), int(column))]
    from scipy.optimize import linear_sum_assignment

    return list(zip(*linear_sum_assignment(cost), strict=True))


def _cost(a: Found, b: Found) -> float:
    weight = np.minimum(a.score, b.score) + 1e-6
    step = float(np.sqrt(((a.xy - b.xy) ** 2).sum(axis=1)) @ weight / weight.sum())
    size = max(math.dist(*one.box.reshape(2, 2).tolist()) for one in (a, b))
    return step / size - overlap(a.box, b.box) if step < _REACH * size else _NEVER
