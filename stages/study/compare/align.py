"""Two series of one motion on one clock: the shift at which they fit best, and how well they do there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.measures import SD_90
from ....pipeline.core.notices import Notice, notice
from ....pipeline.core.rotations import is_finite
from ....pipeline.signals.angles import near
from .side import LEAST_S, Side, one_clock

# Angles that need neither gravity nor a heading, so that a wrong one of these does not shift the clock.
_ANGLES = tuple(
    f"{side}_{name}"
    for side in "rl"
    for name in ("knee_flexion", "elbow_flexion", "thigh_trunk_flexion", "shoulder_flexion")
)
WEAK = 0.5  # r of the angles below which two takes are not of one motion
# And below which they hardly are: of 81 pairs of cameras that saw one captured walk (lifted) one was, of 108 of their
# lifts against the motion capture none, while two walks at cadences of five to four come to 0.73.
_UNUSUAL = 0.75
# Of r: another shift that fits as well. All walks before two cameras have one (docs/visits.md), and in most the best
# shift is wrong; of takes without such a one, of walks with turns, squats, lifts, it is wrong in one of fifty at most.
AMBIGUOUS = 0.9
NARROW = "narrow the search with --offset and --search"  # what to do then
_FINEST_S = 1 / 60  # step of the search
_LEAST_SHARE = 0.5  # of the largest common motion at any shift; less makes chance peaks
_SAME_PEAK_S = 0.25
_FEWEST = 10  # frames that two series are compared by
_MOVING_DEG = 0.5

Align = Literal["auto", "stamps", "correlate"]
At = Callable[[np.ndarray], np.ndarray]  # values (M, K) at any times (M,) of their clock
Score = Callable[[np.ndarray, np.ndarray], tuple[float, float]]  # how well two (N, K) fit, in how many rows


@dataclass(frozen=True)
class Alignment:
    """reference time = a side's time + shift_s. how: "time stamps" or "cross-correlation". r: of the joint angles over
    their means, all at once, at that shift; runner_up: at the best shift elsewhere, NaN when not sought."""

    how: str
    shift_s: float
    r: float
    runner_up: float = float("nan")


def aligned(
    side: Side, reference: Side, align: Align, offset_s: float, search_s: float
) -> tuple[Alignment | None, list[Notice]]:
    """How the side's clock is brought to the reference's, None for takes of different motions, and doubts."""
    together = one_clock(side, reference)
    if align == "auto":
        if reference.run is not None and not together:
            return None, []
        align = "stamps" if together else "correlate"
    how = (
        _stamped(side, reference, offset_s)
        if align == "stamps"
        else correlated(side, reference, offset_s, search_s)
    )
    if how.r >= WEAK and how.runner_up > AMBIGUOUS * how.r:
        so = f"The shift nearest to {offset_s:g} s (--offset) was used: {NARROW}."
        values: dict[str, Any] = {"r": how.r, "runner_up": how.runner_up, "offset_s": offset_s}
        return how, [notice("shift-ambiguous", run=side.name, **values, so=so)]
    if how.r >= (WEAK if together else _UNUSUAL):
        return how, []
    return how, [notice("angles-weak", run=side.name, other=reference.name, r=how.r)]


def _stamped(side: Side, reference: Side, shift_s: float) -> Alignment:
    """By the time stamps and what is to be added to the side's. InputError when they do not overlap."""
    times, names = reference.time_s - shift_s, _of_both(side, reference)
    r, common = _score(_angles(side, side.time_s, names), _angles(reference, side.time_s + shift_s, names))
    inside = ((side.time_s >= times[0]) & (side.time_s <= times[-1])).sum()
    if inside < 3 or not common:
        raise files_apart(_clocks(side, reference), f"an offset of {shift_s:g} s")
    return Alignment("time stamps", shift_s, r)


def correlated(side: Side, reference: Side, offset_s: float, search_s: float) -> Alignment:
    """By the correlation of those of eight joint angles that both know, for shifts within search_s of offset_s, to a
    fraction of a frame (`best_shift`). InputError when less than a second of motion is known to both.
    """
    step_s = max(*(float(np.median(np.diff(each.time_s))) for each in (side, reference)), _FINEST_S)
    times, names = np.arange(side.time_s[0], side.time_s[-1] + 1e-9, step_s), _of_both(side, reference)
    angles = _angles(side, times, names)
    best = best_shift(times, angles, lambda at_s: _angles(reference, at_s, names), _score, offset_s, search_s)
    if best is None:
        tried = f"an offset of {offset_s:g} s and shifts up to {search_s:g} s"
        raise files_apart(_clocks(side, reference), tried)
    shift_s, r, runner_up = best
    # To 0.1 ms: takes of one clock come out at 0, and lose no row at their ends.
    return Alignment("cross-correlation", round(shift_s, 4), r, runner_up)


def best_shift(
    times: np.ndarray, values: np.ndarray, other: At, score: Score, near_s: float, search_s: float
) -> tuple[float, float, float] | None:
    """The shift in seconds, to a fraction of the steps between even times (N,), at which values (N, K) there fit other
    values best, within search_s of near_s; the score there, and at the highest peak elsewhere, NaN without one. None
    where less than a second is common to both at every shift.

    Of shifts that fit about as well it is the one nearest to near_s: of strides that are alike the errors of the poses
    choose, and a second more or less of both takes. score: of the columns that are known to both anywhere."""
    from scipy.ndimage import maximum_filter1d
    from scipy.optimize import minimize_scalar

    step_s = float(times[1] - times[0])
    reach = max(1, int(np.ceil(search_s / step_s)))  # a peak has neighbours
    around = other(times[0] + near_s + step_s * np.arange(-reach, len(times) + reach))
    of_both = np.isfinite(values).any(axis=0) & np.isfinite(around).any(axis=0)
    if not of_both.any():
        return None
    values, around = values[:, of_both], around[:, of_both]
    tried = [score(values, around[i : i + len(times)]) for i in range(2 * reach + 1)]
    scores, common = (np.array(part) for part in zip(*tried, strict=True))
    enough = common * step_s >= max(LEAST_S, _LEAST_SHARE * common.max() * step_s)
    if not (enough & np.isfinite(scores)).any():
        return None
    shifts = near_s + step_s * np.arange(-reach, reach + 1)
    scores = np.where(enough & np.isfinite(scores), scores, -1.0)
    peaks = np.r_[False, (scores[1:-1] > scores[:-2]) & (scores[1:-1] >= scores[2:]), False]
    highest = scores == maximum_filter1d(scores, 2 * int(np.ceil(_SAME_PEAK_S / step_s)) + 1)
    as_good = (peaks & highest & (scores > AMBIGUOUS * scores.max())) | (scores == scores.max())
    chosen = float(min(shifts[as_good], key=lambda shift_s: abs(shift_s - near_s)))

    def score_at(shift_s: float) -> float:
        return score(values, other(times + shift_s)[:, of_both])[0]

    best: Any = minimize_scalar(
        lambda shift_s: -score_at(shift_s),
        bounds=(chosen - step_s, chosen + step_s),
        method="bounded",
        options={"xatol": 1e-4},
    )
    others = scores[peaks & (np.abs(shifts - chosen) > _SAME_PEAK_S)]
    return float(best.x), score_at(float(best.x)), float(others.max()) if len(others) else float("nan")


def files_apart(times: Mapping[str, np.ndarray], tried: str) -> InputError:
    """That both have too little motion in common. times: (T,) of each by its name. tried: which shifts."""
    spans = [f"{name} from {time_s[0]:.6g} to {time_s[-1]:.6g} s" for name, time_s in times.items()]
    return InputError(
        "files-apart",
        f"Expected at least {LEAST_S:g} s of motion in both, got none: {' and '.join(spans)}, with {tried}; give what "
        "must be added to the first one's time with --offset S, or a wider --search S.",
    )


def agreement(
    values: np.ndarray, reference: np.ndarray, sd: np.ndarray | None = None
) -> dict[str, float | int] | None:
    """Of an angle (T,) against a reference (T,), degrees; None when fewer than ten frames have both.

    bias_deg, sd_deg: mean and standard deviation of values less reference; frames of one take are no independent cases.
    rom_deg: 5th to 95th percentile. r: NaN for an angle that hardly changes. within_band: share of frames whose
    difference lies inside the 90 % band of the standard error sd (T,).
    """
    both = np.isfinite(values) & np.isfinite(reference)
    if both.sum() < _FEWEST:
        return None
    off = near(values - reference, 0.0)[both]
    roms = [float(np.subtract(*np.percentile(part[both], [95, 5]))) for part in (values, reference)]
    result: dict[str, float | int] = {
        "frames": int(both.sum()),
        "bias_deg": float(off.mean()),
        "sd_deg": float(np.std(off, ddof=1)),
        "rmse_deg": float(np.sqrt((off**2).mean())),
        "r": correlation(values[both], reference[both], _MOVING_DEG),
        "rom_deg": roms[0],
        "rom_reference_deg": roms[1],
    }
    stated = np.full(1, np.nan) if sd is None else sd[both]
    if np.isfinite(stated).any():
        result["within_band"] = float((np.abs(off) <= SD_90 * stated)[np.isfinite(stated)].mean())
        result["stated_sd_deg"] = float(np.nanmedian(stated))
    return result


def correlation(a: np.ndarray, b: np.ndarray, least: float) -> float:
    """Pearson's r of (T,) and (T,); NaN when the standard deviation of one is below `least`: of what hardly changes, r
    compares the errors."""
    if min(a.std(), b.std()) < least:
        return float("nan")
    return float(np.corrcoef(a, b)[0, 1])


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
    r = float((a * b).sum()) / energy if energy > 1e-9 else float("nan")
    return r, float(both.sum() / both.shape[1])


def _clocks(*sides: Side) -> dict[str, np.ndarray]:
    return {side.name: side.time_s for side in sides}
