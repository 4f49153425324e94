"""Figures of agreement: known answers."""

import numpy as np
import pytest

from pcnet3d.stages.study.compare.figures import agreement, correlation

REFERENCE = 40 + 30 * np.sin(np.linspace(0, 20, 2000))


def test_an_angle_that_is_read_too_large_and_off():
    found = agreement(1.2 * REFERENCE + 3.0, REFERENCE)
    off = 0.2 * REFERENCE + 3.0
    assert found["bias_deg"] == pytest.approx(off.mean())
    assert found["sd_deg"] == pytest.approx(off.std(ddof=1))
    assert found["rmse_deg"] == pytest.approx(np.sqrt((off**2).mean()))
    assert found["rom_deg"] == pytest.approx(1.2 * found["rom_reference_deg"])
    assert found["r"] == pytest.approx(1)


def test_a_difference_across_the_end_of_the_circle_is_small():
    assert agreement(np.full(20, 179.0), np.full(20, -179.0))["bias_deg"] == pytest.approx(-2)


def test_right_errors_hold_nine_tenths():
    off = np.random.default_rng(1).normal(0, 4.0, len(REFERENCE))
    found = agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), 4.0))
    assert found["within_band"] == pytest.approx(0.9, abs=0.02)
    assert "within_band" not in agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), np.nan))


def test_missing_frames_are_left_out_and_too_few_give_nothing():
    values = REFERENCE.copy()
    values[9:] = np.nan
    assert agreement(values, REFERENCE) is None
    values[:100] = REFERENCE[:100]
    assert agreement(values, REFERENCE)["frames"] == 100


def test_what_hardly_changes_has_no_r():
    noise = np.random.default_rng(2).normal(0, 0.1, (2, 50))
    assert np.isnan(correlation(*noise, least=0.5))
    assert np.isfinite(correlation(*noise, least=0.01))
