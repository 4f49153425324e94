"""Angular velocities smoothed by the stated errors of angles: known answers, turns around the range, gaps."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.angle_error.take_angles import AngleSeries, angle_rates
from pcnet3d.pipeline.signals.angles import FINE, MISSING

# As the smoother's model says, nine in ten lie inside with a factor.
NOISE = replace(shipped_noise(), rates={"r_knee_flexion": (2.8, 0.0, 0.0, 0.0)})
TIME = np.arange(240) / 30
SWING = 2 * np.pi * 0.5


def series(value_deg: np.ndarray, sd_deg: float) -> dict[str, AngleSeries]:
    reason = np.where(np.isfinite(value_deg), FINE, MISSING).astype(np.int8)
    sd = np.where(np.isfinite(value_deg), sd_deg, np.nan)
    return {"r_knee_flexion": AngleSeries(value_deg, sd, reason, sd)}


def drift(sd: float) -> np.ndarray:
    """An error that is forgotten over three seconds."""
    rng, kept = np.random.default_rng(0), np.exp(-1 / 90)
    error = rng.normal(size=len(TIME))
    for i in range(1, len(TIME)):
        error[i] = kept * error[i - 1] + np.sqrt(1 - kept**2) * error[i]
    return sd * error


def test_a_swing_without_error_has_its_rate():
    rate, sd = angle_rates(series(30 * np.sin(SWING * TIME), 0.01), TIME, noise=NOISE)["r_knee_flexion"]
    np.testing.assert_allclose(rate[10:-10], (30 * SWING * np.cos(SWING * TIME))[10:-10], atol=0.5)
    assert (sd < 3).all()


def test_an_error_is_smoothed_and_the_bars_hold_what_is_left():
    truth = 30 * SWING * np.cos(SWING * TIME)
    seen = series(30 * np.sin(SWING * TIME) + drift(8.0), 8.0)
    rate, sd = angle_rates(seen, TIME, noise=NOISE)["r_knee_flexion"]
    unstated = {name: replace(of, noise_deg=np.full(len(TIME), np.nan)) for name, of in seen.items()}
    plain, unknown = angle_rates(unstated, TIME)["r_knee_flexion"]
    assert np.sqrt(np.mean((rate - truth) ** 2)) < 0.6 * np.sqrt(np.mean((plain - truth) ** 2))
    assert np.mean(np.abs(rate - truth) <= 1.645 * sd) > 0.9
    assert np.isnan(unknown).all()


@pytest.mark.parametrize("sd", [1.0, np.nan])
def test_a_turn_past_the_end_of_the_range_goes_on(sd):
    turning = np.mod(90 * TIME + 180, 360) - 180
    rate, _ = angle_rates(series(turning, sd), TIME)["r_knee_flexion"]
    np.testing.assert_allclose(rate[10:-10], 90, atol=3)


def test_nothing_is_said_where_the_angle_is_missing_or_across_a_break():
    value = np.where(TIME < 4, 0.0, 50.0)
    value[60:70] = np.nan
    rate, sd = angle_rates(series(value, 1.0), TIME, breaks=(120,))["r_knee_flexion"]
    assert np.isnan(rate[60:70]).all()
    assert np.isnan(sd[60:70]).all()
    assert np.nanmax(np.abs(rate)) < 0.1
