"""Accelerations of wrists and ankles of two runs on one clock, and how they agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .figures import match
from .side import Side

_MOVING = 0.02  # of the reference's largest value: standard deviation of an acceleration that changes


@dataclass(frozen=True, eq=False)
class Accelerations:
    """Norms relative to the pelvis by joint (T,), in the reference's unit of length per s²: of the side, of the
    reference at the side's rows, and the standard error of their difference. agreement: by joint "frames", "rmse" and
    "r"."""

    values: dict[str, np.ndarray]
    reference: dict[str, np.ndarray]
    sd: dict[str, np.ndarray]
    agreement: dict[str, dict[str, float | int]]


def accelerations(side: Side, reference: Side, times: np.ndarray, factor: float) -> Accelerations:
    """Of the joints whose acceleration both know in ten frames or more. times: (T,) the side's rows on the reference's
    clock. factor: from the side's unit of length to the reference's."""
    result = Accelerations({}, {}, {}, {})
    for joint in side.acceleration:
        if joint not in reference.acceleration:
            continue
        values = factor * side.acceleration[joint]
        other = reference.resampled(reference.acceleration[joint], times)
        known = other[np.isfinite(values) & np.isfinite(other)]
        if agreement := match(values, other, _MOVING * float(known.max(initial=0.0))):
            errors = reference.resampled(reference.acceleration_sd[joint], times)
            result.values[joint], result.reference[joint] = values, other
            result.sd[joint] = np.hypot(factor * side.acceleration_sd[joint], errors)
            result.agreement[joint] = agreement
    return result
