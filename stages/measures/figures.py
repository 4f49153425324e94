"""Figures of measures with their errors: every error is one standard deviation; pages end digits at its first."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...models.common.metrics import SD_90
from ...pipeline.core.measures import CANNOT_BE_TOLD, Measure, Moments, Remark
from .cycles import symmetry_index

_FEWEST = 3  # values for a standard error by their spread
# Values for a standard deviation that is stated: of six it is off by a third (one standard error, 1 / sqrt(2 (n - 1))).
FEWEST_FOR_SD = 6
# Per cent, of the ± of a symmetry index: that of one side that moves twice as far as the other.
_SAYS_NOTHING = 200 / 3
_FRAME = float(
    np.sqrt(2 / 12)
)  # of a frame: standard deviation of a duration between two frames (uniform errors)


def time_resolution(fps: float) -> float:
    """Seconds: the standard deviation of one duration that frames bound, each of which is off by half of one at
    most."""
    return _FRAME / fps


def basis(values: np.ndarray) -> list[Measure]:
    """How many frames of (T,) a figure rests on, and the share that has no value."""
    known = np.isfinite(values)
    return [Measure("frames", int(known.sum())), Measure("nan_share", float(1 - known.mean()))]


def spread(
    name: str, unit: str, values: np.ndarray, resolution: float = 0.0, shared: float = 0.0
) -> list[Measure | Remark]:
    """Mean of (N,) with its standard error, and the standard deviation of six values or more, or that they are fewer;
    nothing of none.

    resolution: the standard deviation with which one value is known, independent of the next; shared: the one that all
    values have in common, NaN where unknown. The values' own is left out where it is not larger than the resolution:
    then it is the measurement's, not the person's. Of fewer than three values their spread is not known; with a
    `shared` error they count as spread by the resolution.
    """
    if not len(values):
        return []
    sd = float(values.std(ddof=1)) if len(values) >= _FEWEST else float("nan")
    own = np.fmax(sd, resolution) / np.sqrt(len(values))
    known = np.isfinite(sd) or shared
    error = float(np.hypot(own, shared) if known else 0.0) or float("nan")  # no error is known to be 0
    mean = Measure(f"mean_{name}", float(values.mean()), unit, stated(error))
    return [mean, *deviation(name, unit, values, resolution)]


def deviation(name: str, unit: str, values: np.ndarray, resolution: float) -> list[Measure | Remark]:
    """The standard deviation of (N,) finite values where it is larger than the resolution; the reason for none where
    there are two or more, but fewer than six. Nothing of one, and where the measurement makes it."""
    if len(values) < FEWEST_FOR_SD:
        words = f"a standard deviation needs {FEWEST_FOR_SD} values"
        return [Remark("sd_reason", words)] if len(values) > 1 else []
    sd = float(values.std(ddof=1))
    return [Measure(f"sd_{name}", sd, unit)] if sd > resolution else []


def with_error(name: str, unit: str, value: float, error: float) -> Measure:
    """A figure and its standard error, which is left out where it is not known."""
    return Measure(name, float(value), unit, stated(error))


def stated(error: float) -> float | None:
    """An error, None for one that is not known."""
    return float(error) if np.isfinite(error) else None


def symmetry(right: float, left: float, error: float, of: str = "") -> list[Measure | Remark]:
    """Symmetry index of two figures. error: of right less left, in their unit, NaN where unknown; what both share
    changes an index little; one that is too large leaves the outcome alone, and of steps why. of: what the name begins
    with, of steps."""
    index = symmetry_index(right, left)
    if not np.isfinite(index):
        return []
    error = 200 * error / (right + left)
    if SD_90 * error > _SAYS_NOTHING:
        why = [Remark(f"{of}symmetry_reason", "the error of the difference is too large")] if of else []
        return [Remark(f"{of}symmetry_outcome", CANNOT_BE_TOLD), *why]
    judged = bool(abs(index) <= SD_90 * error) if np.isfinite(error) else None
    return [Measure(f"{of}symmetry_index", float(index), "percent", stated(error), within_error=judged)]


def moments(name: str, values: Iterable[float]) -> Moments:
    """Times in a take in seconds."""
    return Moments(name, tuple(map(float, values)))
