"""Angles from those of the same person standing: what a lifter has wrong throughout a take goes, and the neutral's own
error comes.

Little of a lifter's error is the same in standing and in moving, so that the difference is about as uncertain as two
independent angles (SHARE); the errors of 26 validation clips were not smaller after the subtraction.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.signals.angles import FINE, NO_NEUTRAL, near
from ...pipeline.signals.foot_angles import ALL_ANGLES
from .repeatability import known_median
from .take_angles import AngleSeries

FEWEST = 10  # frames of a neutral
KNEES_HIPS_TRUNK = (
    "r_knee_flexion", "l_knee_flexion", "r_thigh_trunk_flexion", "l_thigh_trunk_flexion", "trunk_lean_sagittal",
)  # fmt: skip
# Of what independent errors come to, the part with which 90 % of the differences of 52 lifted validation takes of three
# people lie inside, each person with one weight (of 1 it is 92 %, of 0.8 87 %).
SHARE = 0.9
# From the 5th to the 95th percentile, beyond which a knee, a hip or the trunk does not stand still.
STILL_DEG = 10.0


def neutral_deg(
    series: Mapping[str, AngleSeries], time_s: np.ndarray, span_s: tuple[float, float]
) -> dict[str, tuple[float, float]]:
    """By angle its median over the frames of a span of time_s (T,), and the middle of their standard deviations (NaN
    where unknown); without angles that fewer than ten of the frames have. InputError where no angle is left."""
    inside = (time_s >= span_s[0]) & (time_s <= span_s[1])
    found = {}
    for name, angle in series.items():
        values = angle.value_deg[inside]
        known = values[np.isfinite(values)]
        if len(known) >= FEWEST:
            first = near(known, known[0])  # no step through 180 degrees
            found[name] = float(np.median(first)), known_median(angle.sd_deg[inside])
    if not found:
        raise InputError(
            "bad-value",
            f"Expected {FEWEST} frames or more with angles in --neutral, got {int(inside.sum())} from {span_s[0]:g} to "
            f"{span_s[1]:g} s; the take is from {time_s[0]:.6g} to {time_s[-1]:.6g} s.",
        )
    return found


def moves_deg(series: Mapping[str, AngleSeries], time_s: np.ndarray, span_s: tuple[float, float]) -> float:
    """By how many degrees the knees, hips and trunk move within a span of time_s (T,) at most, from the 5th to the 95th
    percentile; 0 where none of them is there."""
    inside = (time_s >= span_s[0]) & (time_s <= span_s[1])
    moving = [0.0]
    for name in KNEES_HIPS_TRUNK:
        values = series[name].value_deg[inside]
        values = values[np.isfinite(values)]
        if len(values) >= FEWEST:
            moving.append(float(np.subtract(*np.percentile(values, [95, 5]))))
    return max(moving)


def less_neutral(
    series: Mapping[str, AngleSeries], neutral: Mapping[str, tuple[float, float]], judged: bool
) -> dict[str, AngleSeries]:
    """The angles less their neutral, with the error of that difference; missing where an angle has no neutral.

    judged: whether the built-in lifter made the poses: then a share of the error is known to be in both; of others
    both errors count as independent, which is too much where they are alike.
    """
    result = {}
    for name, angle in series.items():
        if name not in neutral:
            nothing = np.full(len(angle.value_deg), np.nan)
            reason = np.where(angle.reason == FINE, NO_NEUTRAL, angle.reason).astype(np.int8)
            result[name] = replace(angle, value_deg=nothing, sd_deg=nothing, noise_deg=nothing, reason=reason)
            continue
        middle, sd = neutral[name]
        value = near(angle.value_deg - middle, ALL_ANGLES[name].centre_deg)
        both = np.hypot(angle.sd_deg, sd) * (SHARE if judged else 1.0)
        result[name] = replace(angle, value_deg=value, sd_deg=both)
    return result
