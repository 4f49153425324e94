"""Errors of ranges and of differences, and whether they were filmed from about the same place: known answers."""

from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import false_discovery_control, t

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.angle_error.repeatability import (
    FALSE,
    Between,
    difference_chance,
    difference_sd,
    differing,
    ends,
    figure_of,
    range_sd,
    same_place,
    shipped,
    view_deg,
)
from pcnet3d.pipeline.core.measures import Measure
from pcnet3d.pipeline.signals.angles import ANGLES, MIDLINE, of_both
from pcnet3d.stages.rectify import rectify


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=3)


def seen(walk, turned_deg: float = 0.0, pitch_deg: float = 8.0):
    """Rectified by a camera behind the walker's back, turned about the vertical from there."""
    heading = walk.heading_deg[len(walk) // 2] + turned_deg
    camera = aimed(walk.root.mean(axis=0), 6.5, heading, pitch_deg, 0.0)
    return rectify(camera_poses(walk, camera), "geometric")


def test_the_view_is_the_facing_towards_the_camera_and_the_pitch(walk):
    facing, pitch = view_deg(seen(walk, 180.0))
    assert facing == pytest.approx(0, abs=8)  # who walks at the camera
    assert pitch == pytest.approx(8, abs=5)
    left, _ = view_deg(seen(walk, 150.0))
    right, _ = view_deg(seen(walk, 210.0))
    assert left - right == pytest.approx(60, abs=8)


def test_a_tripod_that_is_set_up_again_is_in_the_same_place_and_another_view_is_not(walk):
    first = seen(walk, 160.0)
    assert same_place(first, first)
    assert same_place(first, seen(walk, 168.0, 10.0))
    assert not same_place(first, seen(walk, 220.0))
    assert not same_place(first, seen(walk, 160.0, 25.0))
    behind = seen(walk, -2.0), seen(walk, 2.0)
    assert same_place(*behind)  # across the end of the circle


def test_what_is_not_known_is_elsewhere(walk):
    world = rectify(walk.poses, "geometric")
    assert view_deg(world) is None
    assert not same_place(world, world)


def test_figures_are_named_alike_for_both_sides():
    def of(name: str, *group: str, gait: str = "running") -> str | None:
        return figure_of(Measure(name, 1.0, group=group), gait)

    assert of("p05_p95", "range_of_motion", "r_knee_flexion") == "range_of_motion.knee_flexion"
    assert of("p05_p95", "range_of_motion", "l_knee_flexion") == "range_of_motion.knee_flexion"
    assert of("lowest", "range_of_motion", "l_knee_flexion") is None
    assert of("cadence", "walking") == "running.cadence"
    assert of("cadence", "walking", gait="walking") == "walking.cadence"
    assert of("cadence", "walking", gait="walking or running") == "walking.cadence"
    assert of("mean_stance", "walking", "right") is None
    assert of("mean_rise", "arm_raises", "left") == "arm_raises.mean_rise"
    assert of("steps") is None


def test_a_difference_has_the_fitted_share_of_independent_errors_and_no_figure_is_left_out():
    factors = shipped()["factors"]
    for between in get_args(Between):
        sided = MIDLINE if between == "sides" else ()
        assert {f"range_of_motion.{of_both(name)}" for name in ANGLES if name not in sided} <= factors[
            between
        ].keys()
        for figure, factor in factors[between].items():
            assert difference_sd(figure, (3.0, 4.0), between) == pytest.approx(5 * factor)
    assert difference_sd("unheard.of", (3.0, 4.0), "again") == 5.0


def test_a_range_has_a_share_of_its_ends_errors_and_one_of_itself():
    share, of_range = shipped()["ranges"]["knee_flexion"]
    long = float(np.hypot(10 * share, 50 * of_range))
    assert range_sd("knee_flexion", 50.0, 10.0, np.inf) == pytest.approx(long)
    assert range_sd("knee_flexion", 50.0, 10.0, 2.0) == pytest.approx(np.sqrt(2) * long)
    assert range_sd("unheard.of", 50.0, 10.0, np.inf) == 10.0
    for name in ANGLES:  # two to three times too wide as independent ends
        assert range_sd(of_both(name), 30.0, 12.0, 10.0) < 12.0


def test_ends_carry_the_errors_of_the_frames_beyond_them():
    values = np.concatenate([np.linspace(0, 100, 101), [np.nan]])
    (low, high), sds = ends(values, np.where(values < 50, 3.0, 8.0))
    assert (low, high) == pytest.approx((5.0, 95.0))
    assert sds == (3.0, 8.0)


def test_differences_are_those_of_the_lifter_whose_errors_they_are_shares_of():
    """After a new lifter `pcnet3d lab refit` fits them again."""
    assert shipped()["lifter"] == shipped_noise().lifter


def test_chance_is_a_tenth_at_the_minimal_detectable_change_and_heavier_than_gaussian_beyond():
    at, beyond, none = difference_chance(np.array([-1.645, 3.0, 0.0]))
    assert at == pytest.approx(0.1, abs=1e-3)
    assert 0.0027 < beyond < 0.05
    assert none == pytest.approx(1.0)
    ratio = np.linspace(0, 20, 50)
    known = 2 * t(3).sf(ratio * t(3).isf(0.05) / 1.645)
    np.testing.assert_allclose(difference_chance(ratio), known, atol=1e-14)


@given(
    st.lists(st.sampled_from([0.0011, 0.0213, 0.0317, 0.0613, 0.0971, 0.41, 0.93]), min_size=1, max_size=12)
)
def test_of_many_figures_those_differ_that_chance_does_not_make(chances):
    assert differing(np.array(chances)).tolist() == (false_discovery_control(chances) <= FALSE).tolist()
