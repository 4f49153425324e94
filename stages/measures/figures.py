"""Figures of measures with their errors: every error is one standard deviation; pages end digits at its first. And
curves over a cycle of 0 to 100 %, of strides and of repetitions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...models.angle_error.joint_noise import made_by_the_built_in
from ...models.angle_error.repeatability import difference_sd, range_sd
from ...models.common.motion import Motion
from ...pipeline.core.measures import SD_90, Curve, Measure, Moments, Remark, side_of, withheld
from ...pipeline.signals.angles import ALL_ANGLES, near, of_both, unwrapped
from ...pipeline.signals.filters import resample

POINTS = 101  # of a normalised cycle
_FEWEST = 3  # values for a standard error by their spread
# Values for a standard deviation that is stated: of six it is off by a third (one standard error, 1 / sqrt(2 (n - 1))).
FEWEST_FOR_SD = 6
# Per cent, of the ± of a symmetry index: that of one side that moves twice as far as the other.
_SAYS_NOTHING = 200 / 3
# Standard deviation of an angle by a lifter whose errors were not measured: that of the built-in one, median of lifted
# validation takes (knees 8.4, arms 6.3, elbows 10).
_UNSTATED_DEG = 8.0


def unstated_deg(motion: Motion) -> float:
    """The standard deviation of an angle that states none, for bounds: 0 of motion capture."""
    return _UNSTATED_DEG if motion.unjudged else 0.0


def unknown_deg(motion: Motion) -> float:
    """The same for errors that are told: 0 of motion capture, NaN of a lifter."""
    return float("nan") if motion.unjudged else 0.0


def error_of_sides(motion: Motion, figure: str, errors: tuple[float, float]) -> float:
    """Standard deviation of the right side's figure less the left's, whose errors are independent where nothing is
    known of their difference."""
    if made_by_the_built_in(motion.source):
        return difference_sd(figure, errors, "sides")
    return float(np.hypot(*errors))


def error_of_range(motion: Motion, angle: str, range_deg: float, ends: tuple[float, float]) -> float:
    """Of a range of an angle by the standard deviations of both ends."""
    error = float(np.hypot(*ends))
    if made_by_the_built_in(motion.source):
        return range_sd(of_both(angle), range_deg, error, motion.duration_s)
    return error


def observable(judged: np.ndarray) -> Measure:
    """In how much of the take, by its frames (T,), a movement could be judged."""
    return Measure("observable", 100 * float(judged.mean()) if len(judged) else 0.0)


def spread(name: str, values: np.ndarray, resolution: float = 0.0, shared: float = 0.0) -> list[Measure]:
    """Mean of (N,) with its standard error, and the standard deviation of six values or more; nothing of none.

    resolution: the standard deviation with which one value is known, independent of the next; shared: the one that all
    values have in common, NaN where unknown. The values' own is left out where it is not larger than the resolution:
    then it is the measurement's, not the person's. Of fewer than three values their spread is not known; with a
    `shared` error they count as spread by the resolution.
    """
    if not len(values):
        return []
    sd = float(values.std(ddof=1)) if len(values) >= _FEWEST else float("nan")
    own_sd = np.fmax(sd, resolution) / np.sqrt(len(values))
    has_error = np.isfinite(sd) or shared
    error = float(np.hypot(own_sd, shared) if has_error else 0.0) or float("nan")  # no error is known to be 0
    return [with_error(f"mean_{name}", values.mean(), error), *deviation(name, values, resolution)]


def deviation(name: str, values: np.ndarray, resolution: float) -> list[Measure]:
    """The standard deviation of (N,) finite values, six or more, where it is larger than the resolution; nothing where
    the measurement makes it."""
    if len(values) < FEWEST_FOR_SD:
        return []
    sd = float(values.std(ddof=1))
    return [Measure(f"sd_{name}", sd)] if sd > resolution else []


def with_error(name: str, value: float, error: float) -> Measure:
    """A figure and its standard error, which is left out where it is not known."""
    return Measure(name, float(value), float(error) if np.isfinite(error) else None)


def symmetry(right: float, left: float, error: float, prefix: str = "") -> list[Measure | Remark]:
    """Symmetry index of two figures, 100 (right - left) / ((right + left) / 2): 0 when equal, positive when the right
    is larger (Robinson, Herzog & Nigg, J Manipulative Physiol Ther 10(4), 1987); none of two that are 0 or not known.

    error: of right less left, in their unit, NaN where unknown; what both share changes an index little; with one that
    is too large the index is withheld. prefix: of the name, of steps."""
    if not right + left > 0:
        return []
    index = 200 * (right - left) / (right + left)
    error = 200 * error / (right + left)
    if SD_90 * error > _SAYS_NOTHING:
        return [withheld("error-too-large", f"{prefix}symmetry_index")]
    inside = bool(abs(index) <= SD_90 * error) if np.isfinite(error) else None
    return [replace(with_error(f"{prefix}symmetry_index", index, error), within_error=inside)]


def moments(name: str, values: Iterable[float]) -> Moments:
    """Times in a take in seconds."""
    return Moments(name, tuple(map(float, values)))


def mean_curve(motion: Motion, angle: str, spans: np.ndarray) -> list[Curve]:
    """Mean and, of six or more, standard deviation of an angle over spans (N, 2) in seconds; empty when none is
    whole."""
    curves = normalised(unwrapped(motion.angle(angle)), motion.times, spans, motion.seams)
    if not len(curves):
        return []
    begins = curves[
        :, :1
    ]  # of the first within half a turn of the angle's middle, of others of where that begins
    curves = curves + near(begins, near(begins[:1], ALL_ANGLES[angle].centre_deg)) - begins
    sd = tuple(curves.std(axis=0, ddof=1).tolist()) if len(curves) >= FEWEST_FOR_SD else None
    return [Curve(angle, len(curves), tuple(curves.mean(axis=0).tolist()), sd, side_of(angle))]


def normalised(x: np.ndarray, time_s: np.ndarray, spans: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 101) x (T,) over each of the spans (N, 2), from 0 to 100 % of its duration; spans in which any of x is
    missing are left out. An angle goes through `unwrapped` before."""
    at_s = np.linspace(spans[:, 0], spans[:, 1], POINTS, axis=-1)
    curves = resample(x, time_s, at_s.ravel(), seams).reshape(-1, POINTS)
    return curves[np.isfinite(curves).all(axis=1)]
