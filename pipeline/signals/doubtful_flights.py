"""What may be a flight and is not told as one: unsure hops, flights that a take cuts, and what hides others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core.pose import PoseSequence
from .filters import rate, runs, stretches
from .flights import (
    GRAVITY,
    OVER_FEET,
    PEOPLE_M,
    BodyPath,
    Flight,
    Rule,
    above,
    body_path,
    floor_around,
    is_free,
    lasts_s,
    without_ends,
)

# What may be a hop: by so many statures the lower ankle is above its floor while the body falls for so long as gravity
# lets it, within this share.
_LOW, _FALLS_S, _UNSURE = 0.05, 0.15, 0.3
BRIEF_S = 0.2  # a flight 5 cm high; what hides no longer one hides no jump
# Statures that a part of a flight may be off a fall of gravity: of 3372 begins and ends of captured takes on the floor
# one has such a part, with and without noise, and of those over 0.2 s into a flight or before its end nine in ten.
_PART_OFF = 0.03


@dataclass(frozen=True)
class Hop:
    """From when to when somebody may fly, in seconds; clear: as that of a flight."""

    start_s: float
    stop_s: float
    clear: float = 0.0


def hops(
    level: PoseSequence, rule: Rule, found: Sequence[Flight], stature_m: float | None = None
) -> list[Hop]:
    """When, beside the flights found, both ankles are above their floor and the body falls freely for a while: too
    briefly or too low for a flight, or over a floor that is not sure. Other arguments as those of `flights`."""
    from scipy.signal import savgol_filter

    path = body_path(level, rule)
    if path is None or len(level) < 2:
        return []
    half = max(round(_FALLS_S * rate(level.times) / 2), 1)
    height, step_s = path.centre[:, 2], 1 / rate(level.times)
    fall = -np.asarray(savgol_filter(height, 2 * half + 1, 2, deriv=2, delta=step_s, mode="nearest"))
    free = is_free(fall, _UNSURE, stature_m) & (height - path.lowest > OVER_FEET)
    result = []
    for rows, line, before, after in above(path, level.seams, _LOW, 2 * half + 1):
        if not (before and after):
            continue
        middles = np.zeros(len(free))
        middles[rows.start + half : rows.stop - half] = free[rows.start + half : rows.stop - half]
        for start, stop in stretches(np.convolve(middles, np.ones(2 * half + 1), "same") > 0.5):
            high = float((path.lowest - line)[start:stop].max()) + _LOW
            result.append(Hop(float(path.time_s[start]), float(path.time_s[stop - 1]), high))
    return [
        hop
        for hop in result
        if not any(one.off_s <= hop.stop_s and hop.start_s <= one.land_s for one in found)
    ]


def cut_off(level: PoseSequence, rule: Rule, stature_m: float | None = None) -> list[tuple[float, float]]:
    """(begin, end) in seconds of flights that the take begins or ends in, or that a clip boundary cuts: both ankles are
    above their floor up to there, and the body falls freely onto the floor, or rises freely from it. Arguments of
    `flights`."""
    path = body_path(level, rule)
    if path is None:
        return []
    return [
        (float(path.time_s[rows.start]), float(path.time_s[rows.stop - 1]))
        for rows, way in _pieces(path, level.seams)
        if _part(path, rows, way, stature_m)
    ]


def hidden(level: PoseSequence, rule: Rule) -> list[tuple[float, float]]:
    """(begin, end) in seconds of when neither both ankles and the body are known, nor that one ankle is on its floor,
    if somebody may fly for BRIEF_S around that: between the last and the next moment of a foot on the floor."""
    path = body_path(level, rule)
    if path is None:
        return []
    time_s, last = path.time_s, len(level) - 1
    stands = np.zeros(len(level), dtype=bool)
    for start, stop in pairwise([0, *level.seams, len(level)]):
        ankle, at_s = path.lowest[start:stop], time_s[start:stop]
        if np.isfinite(ankle).any():
            stands[start:stop] = path.either[start:stop] <= floor_around(ankle, at_s, rule.floor_s) + _LOW
    known = stands | (np.isfinite(path.lowest) & np.isfinite(path.centre[:, 2]))
    edges = [(piece.start, piece.stop - 1) for piece in runs(known, time_s, level.seams)]
    gaps = list(pairwise([0, *(row for edge in edges for row in edge), last]))[::2]
    floor = np.flatnonzero(stands)

    def flies(before: int, after: int) -> bool:
        if after - before > 1:  # in the frames beside it nobody may stand either
            before, after = floor[floor <= before].max(initial=0), floor[floor >= after].min(initial=last)
        return bool(time_s[after] - time_s[before] > BRIEF_S + 1e-9)

    return [(float(time_s[a]), float(time_s[b])) for a, b in gaps if b > a and flies(a, b)]


def _pieces(path: BodyPath, seams: tuple[int, ...]) -> list[tuple[slice, int]]:
    """Rows in which the lower ankle is well above the floor from the begin of a clip to a low that was seen (1), or
    from one to the end of a clip (-1), for half as long as a flight at least."""
    edges = {0, len(path.lowest), *seams}
    return [
        (rows, 1 if after else -1)
        for rows, _, before, after in above(path, seams)
        if before != after
        and (rows.start if after else rows.stop) in edges
        and lasts_s(path, rows) >= path.rule.least_s / 2
    ]


def _part(path: BodyPath, rows: slice, way: int, stature_m: float | None) -> bool:
    """Whether rows in the air show a body that comes down onto the floor (way 1) or goes up from it (-1) as one that
    falls freely. So few rows hardly tell how fast a fall gets faster: the path is held against one of gravity."""
    inner = without_ends(path.centre[rows])
    height, time_s = path.centre[rows, 2][inner], path.time_s[rows][inner]
    if not np.isfinite(height).all() or (path.centre[rows, 2] - path.lowest[rows] < OVER_FEET).any():
        return False
    fall = GRAVITY / (stature_m or float(np.mean(PEOPLE_M)))
    time_s = time_s - time_s[-1 if way > 0 else 0]  # from the floor's end
    fallen = height + fall / 2 * time_s**2
    speed, at = np.polyfit(time_s, fallen, 1)
    off = np.sqrt(((fallen - at - speed * time_s) ** 2).mean())
    return bool(off < _PART_OFF and -way * speed > fall * path.rule.least_s / 2)
