"""Figures of agreement: known answers."""

import re

import numpy as np
import pytest

from golden import bodies
from pcnet3d.pipeline import H36M17
from pcnet3d.stages.drawing.charts import scatter
from pcnet3d.stages.study.compare.curves import differences
from pcnet3d.stages.study.compare.figures import (
    agreement,
    correlation,
    cycles_agree,
    joint_agreement,
    view_spread,
)
from pcnet3d.stages.study.compare.page import LOWER_BOUND, _joints

REFERENCE = 40 + 30 * np.sin(np.linspace(0, 20, 2000))


def test_limits_of_agreement_of_known_differences():
    off = np.random.default_rng(0).normal(3.0, 2.0, len(REFERENCE))
    found = agreement(REFERENCE + off, REFERENCE)
    assert found["bias_deg"] == pytest.approx(off.mean())
    assert found["upper_deg"] - found["lower_deg"] == pytest.approx(2 * 1.96 * off.std(ddof=1))
    assert found["rmse_deg"] == pytest.approx(np.sqrt((off**2).mean()))
    assert abs(found["slope"]) < 0.01
    inside = (off > found["lower_deg"]) & (off < found["upper_deg"])
    assert inside.mean() == pytest.approx(0.95, abs=0.02)


def test_an_angle_read_too_large_has_a_slope():
    found = agreement(1.2 * REFERENCE, REFERENCE)
    assert found["slope"] == pytest.approx(0.2 / 1.1)
    assert found["rom_deg"] == pytest.approx(1.2 * found["rom_reference_deg"])
    assert found["r"] == pytest.approx(1)


def test_a_difference_across_the_end_of_the_circle_is_small():
    assert agreement(np.full(20, 179.0), np.full(20, -179.0))["bias_deg"] == pytest.approx(-2)


def test_right_errors_hold_nine_tenths():
    off = np.random.default_rng(1).normal(0, 4.0, len(REFERENCE))
    found = agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), 4.0))
    assert found["within_band"] == pytest.approx(0.9, abs=0.02)
    assert "within_band" not in agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), np.nan))


def test_rounding_errors_do_not_look_like_differences():
    values = REFERENCE + np.random.default_rng(3).normal(0, 1e-7, len(REFERENCE))
    cloud = differences("r_knee_flexion", values, REFERENCE, agreement(values, REFERENCE))
    drawn = scatter([cloud], "differences", "mean of both (°)", least_height=1.0)
    ticks = re.findall(r"<text[^>]*>([^<]*)</text>", drawn)
    assert "0.4" in ticks
    assert not [words for words in ticks if "e" in words and words != "mean of both (°)"]


def test_differences_stand_over_the_mean_of_both_with_bias_and_limits():
    values = REFERENCE + np.where(np.arange(len(REFERENCE)) % 2, 6.0, -2.0)
    values[5] = np.nan
    found = agreement(values, REFERENCE)
    cloud = differences("l_knee_flexion", values, REFERENCE, found)
    np.testing.assert_allclose(cloud.x[:2], np.add(REFERENCE[:2], [-1.0, 3.0]))
    np.testing.assert_allclose(cloud.y[:2], [-2.0, 6.0])
    assert cloud.levels == (found["bias_deg"], found["lower_deg"], found["upper_deg"])
    drawn = scatter([cloud], "differences", "mean of both (°)")
    assert 300 <= drawn.count("h0") <= 350
    assert "nan" not in drawn
    heights = [float(y) for y in re.findall(r'class="line" d="M42 ([0-9.]+)H384"', drawn)]
    bias, lower, upper = heights
    assert upper < bias < lower  # pixels grow downwards
    assert bias - upper == pytest.approx(lower - bias, abs=0.11)


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


def test_view_spread_is_the_standard_deviation_between_takes():
    assert view_spread([REFERENCE, REFERENCE + 2.0]) == pytest.approx(np.sqrt(2))
    assert view_spread([REFERENCE, REFERENCE, REFERENCE]) == 0
    assert view_spread([REFERENCE, np.full(len(REFERENCE), np.nan)]) is None


@pytest.mark.parametrize("paired", [True, False])
def test_a_larger_range_between_visits_is_found_with_its_interval(paired):
    rng = np.random.default_rng(3)
    wave = np.sin(np.pi * np.linspace(0, 1, 101))
    before = (60 + rng.normal(0, 2, (12, 1))) * wave
    after = before + (10 + rng.normal(0, 1, (12, 1))) * wave
    found = cycles_agree(after, before, paired)
    assert found["rom_change_deg"] == pytest.approx(10, abs=1)
    assert found["lower_deg"] < found["rom_change_deg"] < found["upper_deg"]
    assert found["lower_deg"] > 0
    assert (found["upper_deg"] - found["lower_deg"] < 2) == paired
    assert found["largest_deg"] == pytest.approx(10, abs=1)
    assert cycles_agree(after[:1], before, False) is None


def test_a_joint_that_is_off_by_a_known_distance():
    body = np.tile(bodies.facing_camera().astype(float), (40, 1, 1))
    size = np.sqrt((body[0, 1:] ** 2).sum(axis=-1).mean())
    moved = body.copy()
    moved[:20, H36M17.index("r_wrist"), 0] += 0.1
    moved[30:, H36M17.index("head")] = np.nan
    found = joint_agreement(moved, body, metric=True)
    assert "pelvis" not in found
    assert found["r_wrist"]["rms_mm"] == pytest.approx(100 / np.sqrt(2))
    assert found["r_wrist"]["p95_percent"] == pytest.approx(10 / size)
    assert found["head"]["frames"] == 30
    assert found["head"]["rms_mm"] == 0
    assert "rms_mm" not in joint_agreement(moved, body, metric=False)["r_wrist"]
    moved[5:, H36M17.index("head")] = np.nan
    assert "head" not in joint_agreement(moved, body, metric=True)


def test_two_runs_are_told_what_their_agreement_proves():
    body = np.tile(bodies.facing_camera().astype(float), (40, 1, 1))
    found = joint_agreement(body, body, metric=False)
    assert LOWER_BOUND in _joints(found, truth=False)
    assert LOWER_BOUND not in _joints(found, truth=True)
    assert "(mm)" not in _joints(found, truth=True)
    assert _joints({}, truth=False) == ""
