"""Angular velocities of a take, smoothed by the stated errors of its angles, each with its own error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.signals.angles import near, unwrapped
from ...pipeline.signals.filters import derivative
from ..smoother import known_noise
from .joint_noise import JointNoise, shipped_noise
from .take_angles import AngleSeries

# Chosen on lifted takes of validation subjects (pcnet3d lab evaluate errors -o DIR).
_ERROR_S = 3.0  # over which an angle's error is forgotten


def angle_rates(
    series: dict[str, AngleSeries],
    time_s: np.ndarray,
    breaks: Sequence[int] = (),
    by_error: bool = True,
    noise: JointNoise | None = None,
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """{angle: (rate, standard deviation)}, both (T,) degrees a second, NaN where the angle is.

    series: of joints through the low-pass, at time_s (T,). An angle with stated errors goes through the smoother that
    knows them (models/smoother.py), as a process that turns on where it passes the end of its range. breaks:
    rows at which something new begins. by_error: False for derivatives, which is what an angle without stated errors
    has anyway; their error is unknown. noise: of the lifter, the shipped one's without.
    """
    stated = [name for name, angle in series.items() if by_error and np.isfinite(angle.noise_deg).any()]
    rates = {
        name: (
            derivative(angle.value_deg, time_s, _with_turns(angle.value_deg, breaks)),
            np.full(len(time_s), np.nan),
        )
        for name, angle in series.items()
        if name not in stated
    }
    if not stated:
        return rates
    angles = np.stack([unwrapped(series[name].value_deg) for name in stated], axis=1)
    variance = np.stack([series[name].noise_deg for name in stated], axis=1) ** 2
    motion = known_noise(angles[..., None], time_s, variance[..., None, None], breaks, error_s=_ERROR_S)
    finite = np.isfinite(angles)
    rate = np.where(finite, motion.values[1, ..., 0], np.nan)
    sd = np.where(finite, np.sqrt(motion.variance[1, ..., 0]), np.nan)
    noise = shipped_noise() if noise is None else noise
    return rates | {
        name: (rate[:, i], noise.of_rate(name, sd[:, i], rate[:, i])) for i, name in enumerate(stated)
    }


def _with_turns(angle_deg: np.ndarray, breaks: Sequence[int]) -> tuple[int, ...]:
    """The breaks, and where an angle (T,) steps from one end of its range to the other."""
    step = np.diff(angle_deg)
    around = np.abs(step - near(step, 0.0)) > 1.0
    return tuple(sorted({*breaks, *(np.flatnonzero(around & np.isfinite(step)) + 1).tolist()}))
