"""Stances, steps, strides and walks: initial contacts and toe-offs, from the probability of each foot to be on the
floor, and which contacts follow each other as steps of one walk.

Initial contact and toe-off bound the stance of a foot, and toe-off and the next initial contact its swing (Perry &
Burnfield, Gait Analysis, 2nd ed. 2010, chapter 1). A step is from the initial contact of one foot to that of the other,
a stride from one foot's to its next (Hollman, McDade & Petersen, Gait & Posture 34(1), 2011).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...pipeline.signals.filters import resample, runs

OTHER = {"r": "l", "l": "r"}

ON_FLOOR = 0.6  # probability from which stances are as long as the true ones (validation subjects)
_SHORTEST_S = 0.1  # a contact or a swing; a sprinter's stance
_STEP_S = (0.2, 1.5)  # shorter or longer is no step of one walk
FEWEST = 3  # steps of a walk
_FEWEST_FLYING = 2  # steps of a run: in standing, turning and sitting down nobody leaps from foot to foot
_TURNS_DEG = 30.0  # in one step
_NEAREST = 5  # landings that tell how the pelvis swings there; two that see a turn are outvoted
# Times farther apart sideways than in front: feet of a straddle or a jumping jack, not of a step.
_SIDEWAYS = 2.0


@dataclass(frozen=True)
class Stance:
    """One foot on the floor. side: "r" or "l". start_s: initial contact, stop_s: toe-off; NaN where a gap or an end of
    the take hides it."""

    side: str
    start_s: float
    stop_s: float


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
        stances_of_side += [
            Stance(side, float(a), float(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)
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


def walks(
    feet: Mapping[str, Sequence[Stance]],
    between: np.ndarray,
    time_s: np.ndarray,
    least: float,
    seams: Sequence[int] = (),
    facing_deg: np.ndarray | None = None,
) -> list[list[Step]]:
    """Walks of at least three steps in order, runs of two: the feet land in turn, 0.2 to 1.5 s after one another, and
    each passes the other. Standing, turning and the steps to a stop and from it are no part of a walk.

    feet: stances by side. between: (T, 2) how far the right ankle is in front of the left one and to its right, in
    lengths of a leg. least: by how much the first of that changes from landing to landing at least. Where the feet land
    twice as far apart sideways as in front (a jumping jack), a walk ends; so it does at a gap. facing_deg: (T,) where
    the person faces, in any still axes; a step in which that turns by 30 degrees or more ends a walk too, where what
    swings to and fro from step to step, as pelvises do, is no turn.
    """
    lands = sorted(
        (stance.start_s, stance.side)
        for side in feet.values()
        for stance in side
        if stance.start_s == stance.start_s
    )
    at = np.array([start for start, _ in lands])
    ahead, aside = resample(between, time_s, at, seams).T if len(at) else (np.zeros(0), np.zeros(0))
    straddles = np.abs(aside) > _SIDEWAYS * np.abs(ahead)
    pieces = runs(np.asarray(np.isfinite(between).all(axis=1)), time_s, seams)
    broken = _broken(pieces, time_s, at)
    turned = np.zeros(len(broken)) if facing_deg is None else _turned(facing_deg, time_s, lands, seams)
    parts: list[list[Step]] = []
    walk: list[Step] = []
    turn = 0.0  # which way the last step changed what is ahead: right foot forward is positive
    for i, ((start, side), (stop, other)) in enumerate(pairwise(lands)):
        change = float(ahead[i + 1] - ahead[i])
        is_step = (
            side != other
            and _STEP_S[0] <= stop - start <= _STEP_S[1]
            and abs(change) >= least
            and not (straddles[i] or straddles[i + 1] or broken[i] or turned[i] >= _TURNS_DEG)
        )
        if not is_step or (walk and change * turn > 0):
            parts.append(walk)
            walk = []
        if is_step:
            walk.append(Step(other, start, stop))
            turn = change
    ends = [float(time_s[piece.stop - 1]) for piece in pieces]
    moving = [part for walk in [*parts, walk] for part in _between_stops(walk, feet, ends)]
    return [walk for walk in moving if len(walk) >= (_FEWEST_FLYING if _flies(walk, feet) else FEWEST)]


def _flies(walk: Sequence[Step], feet: Mapping[str, Sequence[Stance]]) -> bool:
    """Whether at each initial contact the other foot is off the floor."""
    if not walk:
        return False
    return not any(
        not stance.start_s >= at_s and not stance.stop_s < at_s
        for side, at_s in _landings(walk)
        for stance in feet[OTHER[side]]
    )


def _landings(walk: Sequence[Step]) -> list[tuple[str, float]]:
    """Side and time of each foot that lands: one more than steps."""
    return [(OTHER[walk[0].side], walk[0].start_s), *((step.side, step.stop_s) for step in walk)]


def _between_stops(
    walk: list[Step], feet: Mapping[str, Sequence[Stance]], ends_s: Sequence[float]
) -> list[list[Step]]:
    """A walk in parts, without the steps to and from a foot that stays for more than a stride: there the person stops.
    ends_s: the end of each piece in which the feet are visible; a foot whose toe-off is not seen stays until then.

    The stride is the last before the foot lands or the first after the other has landed, whichever is longer. A person
    who stops on both feet leaves the one behind on the floor as long: the stop is where most of a foot's stay passes
    before the other lands.
    """
    if len(walk) < 2:
        return [walk]
    sides, at_s = zip(*_landings(walk), strict=True)
    stops = []
    for i, side in enumerate(sides):
        leaves = next(stance.stop_s for stance in feet[side] if stance.start_s == at_s[i])
        if np.isnan(leaves):
            leaves = min((end for end in ends_s if end >= at_s[i]), default=at_s[i])
        stays = leaves - at_s[i]
        waits = at_s[i + 1] - at_s[i] if i < len(walk) else np.inf
        beside = [at_s[stop] - at_s[stop - 2] for stop in (i, i + 3) if 2 <= stop <= len(walk)]
        stops.append(bool(beside) and stays > max(beside) and 2 * waits > stays)
    parts = groupby(zip(walk, pairwise(stops), strict=True), key=lambda of: any(of[1]))
    return [[step for step, _ in part] for stopped, part in parts if not stopped]


def _turned(
    facing_deg: np.ndarray, time_s: np.ndarray, lands: Sequence[tuple[float, str]], seams: Sequence[int]
) -> np.ndarray:
    """(N - 1,) degrees by which the person turns from landing to landing (time and side), but for what swings."""
    if not lands:
        return np.zeros(0)
    at_s, sides = map(np.array, zip(*lands, strict=True))
    facing = _facing(facing_deg, time_s, at_s, seams)
    ends = np.flatnonzero((np.diff(at_s) > _STEP_S[1]) | (sides[1:] == sides[:-1])) + 1
    swing = np.concatenate([_swing(of_walk) for of_walk in np.split(facing, ends)])
    return np.abs(np.diff(facing - swing))


def _facing(facing_deg: np.ndarray, time_s: np.ndarray, at_s: np.ndarray, seams: Sequence[int]) -> np.ndarray:
    """facing_deg (T,) at other times (N,), without jumps by a whole turn."""
    angle = np.radians(facing_deg)
    x, y = resample(np.stack([np.cos(angle), np.sin(angle)], axis=-1), time_s, at_s, seams).T
    finite = np.isfinite(x)
    result = np.full(len(at_s), np.nan)
    result[finite] = np.degrees(np.unwrap(np.arctan2(y[finite], x[finite])))
    return result


def _swing(facing_deg: np.ndarray) -> np.ndarray:
    """What of facing_deg (N,) at landings, of one foot and the other in turn, is of the foot that lands: half of by how
    much it differs from the mean of the landings before and after, in the median of the nearest five, for one foot, and
    less that for the other; who walks backwards swings the other way. Landings about which the person turns tell
    nothing of it; the other foot's before and after are apart there."""
    foot = (-1.0) ** np.arange(len(facing_deg))
    before, after = facing_deg[:-2], facing_deg[2:]
    differs = foot[1:-1] * (facing_deg[1:-1] - (before + after) / 2)
    tells = np.flatnonzero(np.isfinite(differs) & (np.abs(after - before) < _TURNS_DEG))
    if not len(tells):
        return np.zeros(len(facing_deg))
    medians = np.median(sliding_window_view(differs[tells], min(_NEAREST, len(tells))), axis=1)
    nearest = np.searchsorted((tells[1:] + tells[:-1]) / 2 + 1, np.arange(len(facing_deg)))
    return foot * medians[np.clip(nearest - _NEAREST // 2, 0, len(medians) - 1)] / 2


def _broken(pieces: Sequence[slice], time_s: np.ndarray, at_s: np.ndarray) -> np.ndarray:
    """(N - 1,) whether the rows from one landing at_s (N,) to the next are not all of one of the pieces."""
    piece_of = np.full(len(time_s) + 1, -1)  # the last one of landings before and behind all rows
    for number, rows in enumerate(pieces):
        piece_of[rows] = number
    first = np.searchsorted(time_s, at_s[:-1])
    last = np.searchsorted(time_s, at_s[1:], side="right") - 1
    return (first > last) | (piece_of[first] < 0) | (piece_of[first] != piece_of[last])
