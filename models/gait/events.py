"""Stances, steps and strides: when feet land and leave, out of how likely each is on the floor.

Initial contact and toe-off bound the stance of a foot, and toe-off and the next initial contact its swing (Perry &
Burnfield, Gait Analysis, 2nd ed. 2010, chapter 1). A step is from the initial contact of one foot to that of the other,
a stride from one foot's to its next (Hollman, McDade & Petersen, Gait & Posture 34(1), 2011).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ...pipeline.signals.filters import runs

ON_FLOOR = 0.6  # probability from which stances are as long as the true ones (validation subjects)
_SHORTEST_S = 0.1  # a contact or a swing; a sprinter's stance


@dataclass(frozen=True)
class Stance:
    """One foot on the floor. side: "r" or "l". start_s: initial contact, stop_s: toe-off; NaN where a gap or an end of
    the take hides it. seen_s: from when to when the foot is seen without a gap."""

    side: str
    start_s: float
    stop_s: float
    seen_s: tuple[float, float] = field(default=(-np.inf, np.inf), kw_only=True)


@dataclass(frozen=True)
class Step:
    """From one foot's initial contact to the other's. side: the foot that lands at stop_s."""

    side: str
    start_s: float
    stop_s: float


@dataclass(frozen=True)
class Stride:
    """From one foot's initial contact, start_s, to its next, stop_s. off_s: its toe-off between; other_off_s and
    other_start_s: the other foot's toe-off after start_s (before it in a run), and its initial contact. NaN where
    unseen."""

    side: str
    start_s: float
    stop_s: float
    off_s: float
    other_off_s: float
    other_start_s: float


def stances(
    probability: Mapping[str, np.ndarray], time_s: np.ndarray, seams: Sequence[int] = ()
) -> dict[str, list[Stance]]:
    """{side: stances in order} of probabilities (T,) by side at time_s (T,): where they pass 0.6, between rows.
    Contacts and swings of less than a tenth of a second count as none."""
    return {side: _stances(side, values, time_s, seams) for side, values in probability.items()}


def _stances(side: str, values: np.ndarray, time_s: np.ndarray, seams: Sequence[int]) -> list[Stance]:
    stances_of_side = []
    for piece in runs(np.isfinite(values), time_s, seams):
        p, t = values[piece], time_s[piece]
        turns = [
            t[row] + (t[row + 1] - t[row]) * (ON_FLOOR - p[row]) / (p[row + 1] - p[row])
            for row in np.flatnonzero(np.diff(p > ON_FLOOR))
        ]
        lands = bool(len(p)) and not p[0] > ON_FLOOR  # whether the first turn is an initial contact
        while len(turns) > 1 and min(b - a for a, b in pairwise(turns)) < _SHORTEST_S:
            shortest = int(np.argmin(np.diff(turns)))
            del turns[shortest : shortest + 2]
        edges = [*([] if lands else [np.nan]), *turns]
        edges += [np.nan] if len(edges) % 2 else []
        seen_s = float(t[0]), float(t[-1])
        stances_of_side += [
            Stance(side, float(a), float(b), seen_s=seen_s)
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        ]
    return stances_of_side


def strides(walks: Sequence[Sequence[Step]], feet: Mapping[str, Sequence[Stance]]) -> list[Stride]:
    """Of every two steps in a row, walk by walk, with the toe-offs that lie in them."""
    made = []
    offs = {side: np.sort([stance.stop_s for stance in of]) for side, of in feet.items()}
    for walk in walks:
        for first, second in pairwise(walk):
            side, other = second.side, first.side
            # The other foot's stance before it lands at first.stop_s ends about when this foot lands.
            made.append(
                Stride(
                    side,
                    first.start_s,
                    second.stop_s,
                    _off(offs[side], first.start_s, second.stop_s),
                    _off(offs[other], first.start_s - (first.stop_s - first.start_s), first.stop_s),
                    first.stop_s,
                )
            )
    return made


def _off(offs: np.ndarray, after_s: float, before_s: float) -> float:
    """The last of toe-offs (N,), which increase, between; NaN where there is none."""
    last = int(np.searchsorted(offs, before_s)) - 1
    return float(offs[last]) if last >= 0 and offs[last] > after_s else float("nan")


def contact_times(walks: Sequence[Sequence[Step]], side: str) -> list[float]:
    """Seconds at which one foot lands: a step begins with an initial contact of the other foot and ends with one."""
    starts = [walk[0].start_s for walk in walks if walk[0].side != side]
    return sorted({*starts, *(step.stop_s for walk in walks for step in walk if step.side == side)})
