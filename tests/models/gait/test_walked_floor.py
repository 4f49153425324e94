"""Floors whose height, slope and stairs are known."""

import numpy as np
import pytest

from pcnet3d.models.gait.walked_floor import walked_floor
from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE

WAY = np.array([0.6, 0.8])


STEP, TREAD = 0.7, 0.28


def places(heights, first=0.0, step=STEP):
    along = first + step * np.arange(len(heights))
    return np.column_stack([along[:, None] * WAY, heights])


def test_a_level_floor_has_its_height_and_errors():
    found = walked_floor(places(np.full(9, -1.5)), 0.03, 0.04, 0.0)
    assert found.height == pytest.approx(-1.5)
    assert found.height_sd == pytest.approx(np.hypot(0.01, 0.04))
    assert found.slope_deg == pytest.approx(0, abs=1e-9)
    assert found.stairs == "none"


@pytest.mark.parametrize("slope_deg", [4.0, -4.0])
def test_a_ramp_has_its_slope_and_is_no_stairs(slope_deg):
    heights = np.tan(np.radians(slope_deg)) * 0.7 * np.arange(8)
    found = walked_floor(places(heights), 0.03, 0.0, 1.0)
    assert found.slope_deg == pytest.approx(slope_deg)
    assert found.slope_sd_deg > 1.0
    assert found.stairs == "none"


@pytest.mark.parametrize("slope_deg", [5.0, -5.0])
@pytest.mark.parametrize("short", [0.3, -0.3])
def test_a_ramp_there_and_back_has_the_slope_of_the_way_there(slope_deg, short):
    """Its sign was that of the few decimetres by which the last step lies behind the first, or before it."""
    along = np.r_[STEP * np.arange(9), STEP * np.arange(7, 0, -1), short]
    heights = np.tan(np.radians(slope_deg)) * along
    found = walked_floor(np.column_stack([along[:, None] * WAY, heights]), 0.01, 0.0, 1.0)
    assert found.slope_deg == pytest.approx(slope_deg)


@pytest.mark.parametrize("slope_deg", [1.0, 4.0, 8.0, -8.0])
@pytest.mark.parametrize("shaken", [0.0, 0.005])
def test_a_ramp_whose_places_are_measured_is_no_stairs(slope_deg, shaken):
    """Motion capture states no error of places: then every millimetre by which a foot stands higher was a stair."""
    even = np.tan(np.radians(slope_deg)) * STEP * np.arange(12)
    for seed in range(20):
        heights = even + np.random.default_rng(seed).normal(0, shaken, 12)
        found = walked_floor(places(heights), 0.0, 0.0, 0.0)
        assert found.slope_deg == pytest.approx(slope_deg, abs=0.5)
        assert found.stairs == "none"


def test_the_error_of_up_tilts_what_is_far_away():
    near, far = (walked_floor(places(np.zeros(6), first), 0.02, 0.0, 2.0) for first in (-1.75, 8.25))
    assert far.height_sd == pytest.approx(np.hypot(near.height_sd, 10 * np.tan(np.radians(2))), rel=0.01)


def test_stairs_are_three_rises_in_a_row_beyond_the_error():
    up = np.array([0, 0, 0.17, 0.34, 0.51, 0.68, 0.68])
    for sd in (0.0, 0.03, 0.05):
        assert walked_floor(places(up, step=TREAD), sd, 0.0, 1.0).stairs == "up"
        assert walked_floor(places(-up, step=TREAD), sd, 0.0, 1.0).stairs == "down"
    assert walked_floor(places(up, step=TREAD), 0.1, 0.0, 1.0).stairs == CANNOT_BE_TOLD
    shaken = up + 0.2 * (-1) ** np.arange(len(up))
    assert walked_floor(places(shaken, step=TREAD), 0.0, 0.0, 1.0).stairs == NONE
    kerb = walked_floor(places(np.repeat([0.0, 0.17], [4, 5]), step=TREAD), 0.03, 0.0, 1.0)
    assert (kerb.stairs, kerb.rises.tolist()) == ("none", [0, 0, 0, 1, 0, 0, 0, 0])


@pytest.mark.parametrize(("longest", "stairs"), [(1.0, "down"), (4.5, CANNOT_BE_TOLD)])
def test_a_long_lens_from_above_makes_no_stairs(longest, stairs):
    """A flat car park, filmed from above by a long lens: "Stairs: up", slope 31 ± 7 degrees."""
    pitch = np.radians(35.0)
    axis = np.array([np.cos(pitch), 0.0, -np.sin(pitch)])
    true = np.column_stack([25 - STEP * np.arange(9), np.zeros(9), np.full(9, -25 * np.tan(pitch))])
    nearer = (
        -(1 - 1 / 4) * (true @ axis)[:, None] * axis
    )  # by a focal length that is a fourth of the true one
    places = true + nearer
    found = walked_floor(places, 0.03, 0.0, 2.0, (longest - 1) * (places @ axis)[:, None] * axis)
    assert abs(found.slope_deg) > 20
    assert (abs(found.slope_deg) < 1.7 * found.slope_sd_deg) == (longest > 1)
    assert found.stairs == stairs


@pytest.mark.parametrize(("sds", "stairs"), [(1.8, CANNOT_BE_TOLD), (2.2, "up")])
def test_a_stair_is_two_standard_deviations_of_a_difference_high(sds, stairs):
    sd = 0.05
    up = sds * np.sqrt(2) * sd * np.array([0, 0, 1, 2, 3, 4, 4])
    assert walked_floor(places(up, step=TREAD), sd, 0.0, 0.0).stairs == stairs


def test_stated_slopes_hold_nine_in_ten():
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(400):
        found = walked_floor(places(rng.normal(0, 0.03, 8)), 0.03, 0.0, 0.0)
        inside.append(abs(found.slope_deg) <= 1.645 * found.slope_sd_deg)
    assert 0.87 < np.mean(inside) < 0.97


def test_few_places_or_one_make_no_floor():
    assert walked_floor(places(np.zeros(3)), 0.03, 0.0, 0.0) is None
    assert walked_floor(np.zeros((6, 3)), 0.03, 0.0, 0.0) is None
