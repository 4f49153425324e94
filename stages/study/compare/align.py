"""Two takes of one motion on one clock and in one heading: the shift at which their joint angles fit best."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.rotations import is_finite
from .side import LEAST_S, Side

# Angles that need neither gravity nor a heading, so that a wrong one of these does not shift the clock.
_ANGLES = tuple(
    f"{side}_{name}"
    for side in "rl"
    for name in ("knee_flexion", "elbow_flexion", "thigh_trunk_flexion", "shoulder_flexion")
)
WEAK = 0.5  # r of the angles below which two takes are not of one motion
# And below which they hardly are: of 81 pairs of cameras that saw one captured walk (lifted) one was, of 108 of their
# lifts against the motion capture none, while two walks at cadences of five to four come to 0.73.
UNUSUAL = 0.75
# Of r: another shift that fits as well. All walks before two cameras have one (docs/visits.md), and in most the best
# shift is wrong; of takes without such a one, of walks with turns, squats, lifts, it is wrong in one of fifty at most.
AMBIGUOUS = 0.9
NARROW = "narrow the search with --offset and --search"  # what to do then
_FINEST_S = 1 / 60  # step of the search
LEAST_SHARE = 0.5  # of the largest common motion at any shift; less makes chance peaks
SAME_PEAK_S = 0.25


@dataclass(frozen=True)
class Alignment:
    """reference time = a side's time + shift_s. how: "time stamps" or "cross-correlation". r: of the joint angles over
    their means, all at once, at that shift; runner_up: at the best shift elsewhere, NaN when not sought."""

    how: str
    shift_s: float
    r: float
    runner_up: float = float("nan")


def stamped(side: Side, reference: Side, shift_s: float) -> Alignment:
    """By the time stamps and what is to be added to the side's. InputError when they do not overlap."""
    times, names = reference.time_s - shift_s, _of_both(side, reference)
    r, common = _score(_angles(side, side.time_s, names), _angles(reference, side.time_s + shift_s, names))
    inside = ((side.time_s >= times[0]) & (side.time_s <= times[-1])).sum()
    if inside < 3 or not common:
        raise InputError("files-apart", _apart(side, reference, shift_s, 0.0))
    return Alignment("time stamps", shift_s, r)


def correlated(side: Side, reference: Side, offset_s: float, search_s: float) -> Alignment:
    """By the correlation of those of eight joint angles that both know, for shifts within search_s of offset_s, to a
    fraction of a frame (`best_shift`). InputError when less than a second of motion is known to both.
    """
    step = max(*(float(np.median(np.diff(each.time_s))) for each in (side, reference)), _FINEST_S)
    reach = max(1, int(np.ceil(search_s / step)))  # a peak has neighbours
    times = np.arange(side.time_s[0], side.time_s[-1] + 1e-9, step)
    around = times[0] + offset_s + step * np.arange(-reach, len(times) + reach)
    names = _of_both(side, reference)
    angles, other = _angles(side, times, names), _angles(reference, around, names)
    of_both = np.isfinite(angles).any(axis=0) & np.isfinite(other).any(axis=0)
    if not of_both.any():
        raise InputError("files-apart", _apart(side, reference, offset_s, search_s))
    angles, other = angles[:, of_both], other[:, of_both]
    tried = [_score(angles, other[i : i + len(times)]) for i in range(2 * reach + 1)]
    scores, common = (np.array(part) for part in zip(*tried, strict=True))
    enough = common * step >= max(LEAST_S, LEAST_SHARE * common.max() * step)
    if not (enough & np.isfinite(scores)).any():
        raise InputError("files-apart", _apart(side, reference, offset_s, search_s))

    def score(shift_s: float) -> float:
        return _score(angles, _angles(reference, times + shift_s, names)[:, of_both])[0]

    shifts = offset_s + step * np.arange(-reach, reach + 1)
    shift_s, runner_up = best_shift(shifts, np.where(enough, scores, np.nan), score, offset_s)
    # To 0.1 ms: takes of one clock come out at 0, and lose no row at their ends.
    return Alignment("cross-correlation", round(shift_s, 4), score(shift_s), runner_up)


def best_shift(
    shifts: np.ndarray, scores: np.ndarray, score: Callable[[float], float], near_s: float
) -> tuple[float, float]:
    """The shift in seconds, to a fraction of the steps between shifts (N,), and the highest peak of scores (N,)
    elsewhere, NaN without one. Of shifts that fit about as well it is the one nearest to near_s: of strides that are
    alike the errors of the poses choose, and a second more or less of both takes. scores: NaN where nothing is known.
    score: at any shift."""
    from scipy.ndimage import maximum_filter1d
    from scipy.optimize import minimize_scalar

    scores, step_s = np.nan_to_num(scores, nan=-1.0), float(shifts[1] - shifts[0])
    peaks = np.r_[False, (scores[1:-1] > scores[:-2]) & (scores[1:-1] >= scores[2:]), False]
    highest = scores == maximum_filter1d(scores, 2 * int(np.ceil(SAME_PEAK_S / step_s)) + 1)
    as_good = (peaks & highest & (scores > AMBIGUOUS * scores.max())) | (scores == scores.max())
    chosen = float(min(shifts[as_good], key=lambda shift_s: abs(shift_s - near_s)))
    best: Any = minimize_scalar(
        lambda shift_s: -score(shift_s),
        bounds=(chosen - step_s, chosen + step_s),
        method="bounded",
        options={"xatol": 1e-4},
    )
    others = scores[peaks & (np.abs(shifts - chosen) > SAME_PEAK_S)]
    return float(best.x), float(others.max()) if len(others) else float("nan")


def size_ratio(side: np.ndarray, reference: np.ndarray) -> float:
    """How many times larger joints (T, J, 3) about the pelvis are in the reference than in a side."""
    both = is_finite(side) & is_finite(reference)
    return float(np.sqrt((reference[both] ** 2).sum() / max(float((side[both] ** 2).sum()), 1e-12)))


def _of_both(side: Side, reference: Side) -> list[str]:
    """Those of _ANGLES that both sides know anywhere; all of them where there is none, so that they have no common
    time."""
    both = [
        name for name in _ANGLES if all(np.isfinite(each.angles[name]).any() for each in (side, reference))
    ]
    return both or list(_ANGLES)


def _angles(side: Side, time_s: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """(N, K) degrees of these angles at times (N,) of the side's clock."""
    return np.stack([side.at(name, time_s) for name in names], axis=1)


def _score(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Correlation of a and b (N, K) over all columns, each about its own mean, and the mean count of common rows."""
    both = np.isfinite(a) & np.isfinite(b)
    count = np.maximum(both.sum(axis=0), 1)
    a, b = np.where(both, a, 0.0), np.where(both, b, 0.0)
    a, b = (np.where(both, x - x.sum(axis=0) / count, 0.0) for x in (a, b))
    energy = float(np.sqrt((a**2).sum() * (b**2).sum()))
    return (float((a * b).sum()) / energy if energy > 1e-9 else float("nan")), float(
        both.sum() / both.shape[1]
    )


def _apart(side: Side, reference: Side, offset_s: float, search_s: float) -> str:
    spans = [
        f"{each.name} from {each.time_s[0]:.6g} to {each.time_s[-1]:.6g} s" for each in (side, reference)
    ]
    tried = f" and shifts up to {search_s:g} s" if search_s else ""
    return (
        f"Expected at least {LEAST_S:g} s of motion in both, got none: {' and '.join(spans)}, with an offset of "
        f"{offset_s:g} s{tried}; give what must be added to the first one's time with --offset S, or a wider "
        "--search S."
    )
