"""Repetitions, steps, normalised curves and smoothness of signals whose answers are known."""

import numpy as np
import pytest

from pcnet3d.pipeline.motion.cycles import (
    POINTS,
    landings,
    normalised,
    repetitions,
    steps,
    strides,
    symmetry_error,
    symmetry_index,
)
from pcnet3d.pipeline.motion.smoothness import log_dimensionless_jerk, path_length, sparc

FPS = 30
TIME = np.arange(10 * FPS + 1) / FPS
WAVES = 50 - 50 * np.cos(np.pi * TIME)  # five in ten seconds, 0 to 100


def stroke(seconds, fps):
    """Speed of one minimum-jerk movement (Flash & Hogan 1985), from rest to rest."""
    share = np.linspace(0, 1, round(seconds * fps) + 1)
    return 30 * share**2 * (1 - share) ** 2


def test_each_wave_is_a_repetition_with_its_times():
    found = repetitions(WAVES, TIME, 40)
    assert len(found) == 5
    tenth = np.arccos(0.8) / np.pi  # 50 - 50 cos(pi t) = 10
    for i, one in enumerate(found):
        assert one.start_s == pytest.approx(2 * i + tenth, abs=2e-3)
        assert one.peak_s == pytest.approx(2 * i + 1)
        assert one.stop_s == pytest.approx(2 * i + 2 - tenth, abs=2e-3)
        assert (one.peak, one.rise) == (pytest.approx(100), pytest.approx(100, abs=0.5))


def test_the_same_backwards():
    there, back = repetitions(WAVES, TIME, 40), repetitions(WAVES[::-1], TIME, 40)[::-1]
    np.testing.assert_allclose([10 - one.stop_s for one in back], [one.start_s for one in there])
    np.testing.assert_allclose([one.down for one in back], [one.up for one in there], atol=1e-6)


@pytest.mark.parametrize(("least", "count"), [(99, 5), (101, 0)])
def test_only_rises_that_are_high_enough(least, count):
    assert len(repetitions(WAVES, TIME, least)) == count


def test_a_dip_at_the_top_and_two_equal_tops_are_one_repetition():
    dipped = np.minimum(WAVES, 80 - 10 * np.sin(4 * np.pi * TIME) ** 2)
    assert len(repetitions(dipped, TIME, 40)) == 5


def test_a_rise_without_its_return_is_none():
    assert repetitions(WAVES[: FPS + 5], TIME[: FPS + 5], 40) == []
    assert repetitions(WAVES[FPS - 5 : 2 * FPS], TIME[FPS - 5 : 2 * FPS], 40) == []


def test_nothing_across_gaps_clip_boundaries_and_jumps_in_time():
    gap = WAVES.copy()
    gap[FPS] = np.nan  # at the top of the first
    assert len(repetitions(gap, TIME, 60)) == 4
    assert len(repetitions(WAVES, TIME, 60, seams=(3 * FPS,))) == 4
    assert len(repetitions(WAVES, TIME + (TIME >= 5), 60)) == 4


def test_a_pause_on_the_way_up_is_part_of_the_movement_and_not_smooth():
    one = np.concatenate([np.zeros(FPS), np.cumsum(stroke(1, FPS)) / FPS, np.ones(FPS)])
    two = np.concatenate([one / 2, 0.5 + one[FPS:] / 2])
    smooth, paused = (np.concatenate([way, way[::-1]]) * 90 for way in (one, two))
    (whole,) = repetitions(smooth, np.arange(len(smooth)) / FPS, 40)
    (broken,) = repetitions(paused, np.arange(len(paused)) / FPS, 40)
    assert whole.up == (pytest.approx(-1.40, abs=0.03), pytest.approx(-4.42, abs=0.05))
    assert broken.up[0] < whole.up[0] - 0.3
    assert broken.up[1] < whole.up[1] - 2


def test_curves_over_a_cycle():
    spans = np.array([(0.0, 2.0), (2.0, 4.0), (4.5, 6.5)])
    curves = normalised(WAVES, TIME, spans)
    share = np.linspace(0, 1, POINTS)
    for curve, start in zip(curves, (0, 0, 0.5), strict=True):
        np.testing.assert_allclose(curve, 50 - 50 * np.cos(np.pi * (start + 2 * share)), atol=0.01)


def test_cycles_with_a_missing_row_are_left_out():
    gap = WAVES.copy()
    gap[10] = np.nan
    spans = np.array([(0.0, 2.0), (2.0, 4.0), (9.0, 11.0)])
    assert len(normalised(gap, TIME, spans)) == 1
    assert normalised(gap, TIME, np.zeros((0, 2))).shape == (0, POINTS)


def test_steps_of_a_limping_walk():
    """The right foot lands 0.7 s after the left one, the left one 0.5 s after the right one."""
    phase = np.interp(TIME, [0, *np.cumsum([0.7, 0.5] * 8)], np.arange(17))
    (walk,) = steps(-np.cos(np.pi * phase), TIME, 0.5)
    assert [step.side for step in walk[:4]] == ["l", "r", "l", "r"]
    for step in walk:
        expected = 0.7 if step.side == "r" else 0.5
        assert step.stop_s - step.start_s == pytest.approx(expected, abs=0.02)
    np.testing.assert_allclose(np.diff(strides([walk], "r")), 1.2, atol=0.02)
    assert len(strides([walk], "r")) + len(strides([walk], "l")) == len(walk) - 1


def test_a_landing_just_before_the_end_counts_once_the_foot_goes_back():
    """One foot after the other every 0.5 s, from 0.25 s on; the take is cut behind the landing at 2.25 s."""
    apart = np.sin(2 * np.pi * TIME)
    for stop_s, count in ((2.3, 3), (2.45, 4), (2.6, 4)):
        end = round(stop_s * FPS)
        (walk,) = steps(apart[:end], TIME[:end], 1.5)
        assert len(walk) == count
        (mirrored,) = steps(-apart[:end][::-1], TIME[:end], 1.5)  # the same at the other end
        assert len(mirrored) == count


def test_no_steps_in_slow_sways_single_lunges_and_across_gaps():
    assert steps(np.cos(np.pi * TIME / 2), TIME, 0.5) == []  # 2 s from foot to foot
    assert steps(np.sin(2 * np.pi * TIME[:50]), TIME[:50], 0.5) == []  # three landings, two steps
    gap = np.cos(2 * np.pi * TIME)
    gap[5::30] = np.nan
    assert steps(gap, TIME, 0.5) == []


def test_feet_apart_sideways_do_not_land():
    """Jumping jacks were counted as steps: ankles 0.8 legs apart sideways, whose depths were off by 0.2."""
    apart = 0.2 * np.sin(2 * np.pi * TIME)
    assert steps(apart, TIME, 0.3, aside=np.full(len(TIME), 0.8)) == []
    (walk,) = steps(apart, TIME, 0.3, aside=np.full(len(TIME), 0.3))
    assert len(walk) > 3


def test_symmetry_index():
    assert symmetry_index(50, 50) == 0
    assert symmetry_index(60, 40) == pytest.approx(40)
    assert symmetry_index(40, 60) == pytest.approx(-40)
    assert np.isnan(symmetry_index(0, 0))


def test_the_error_of_the_symmetry_index_is_that_of_draws():
    draws = np.random.default_rng(0).normal((60, 45), (1.5, 2.5), (20000, 2))
    off = np.std([symmetry_index(right, left) for right, left in draws])
    assert symmetry_error(60, 45, 1.5, 2.5) == pytest.approx(off, rel=0.03)
    assert np.isnan(symmetry_error(60, 45, np.nan, 1))


def test_every_step_lies_between_two_landings():
    (walk,) = steps(np.sin(2 * np.pi * TIME[:80]), TIME[:80], 1.5)
    both = landings([walk], "r") + landings([walk], "l")
    assert len(both) == len(walk) + 1
    np.testing.assert_allclose(np.sort(both), [walk[0].start_s, *(step.stop_s for step in walk)])


def test_who_sways_before_the_walk_has_not_landed_yet():
    """A sway of 0.15 in 0.4 s, then a walk; it is a landing only for who does not know that it is noise."""
    sway, walk = 0.15 * np.sin(np.pi * TIME[:12] / 0.8) - 0.15, TIME[: 2 * FPS + 10]
    apart = np.concatenate([sway, -0.4 + 0.4 * np.cos(2 * np.pi * walk)])
    times = np.arange(len(apart)) / FPS
    found = {noise: min(landings(steps(apart, times, 0.5, noise=noise), "r")) for noise in (0.0, 0.15)}
    assert found[0.0] == pytest.approx(0.4, abs=0.04)
    assert found[0.15] == pytest.approx(1.4, abs=0.04)


@pytest.mark.parametrize("size", [1.0, 700.0])
@pytest.mark.parametrize("seconds", [0.8, 3.0])
def test_smoothness_of_one_minimum_jerk_stroke(seconds, size):
    speed = size * stroke(seconds, 60)
    assert log_dimensionless_jerk(speed, 60) == pytest.approx(-np.log(204.8), abs=0.02)  # 720 / 1.875^2
    # The arc of |V(f)| / |V(0)| from 0 to where it is last 0.05, both axes scaled to 1, by fine sums.
    share = np.linspace(0, 1, 2001)
    hz = np.linspace(0, 10, 4001)
    weights = share**2 * (1 - share) ** 2
    spectrum = np.abs(np.exp(-2j * np.pi * hz[:, None] * share * seconds) @ weights)
    spectrum = spectrum[: np.flatnonzero(spectrum >= 0.05 * spectrum[0])[-1] + 1] / spectrum[0]
    expected = -np.hypot(1 / (len(spectrum) - 1), np.diff(spectrum)).sum()
    assert sparc(speed, 60) == pytest.approx(expected, abs=0.02)


def test_shaking_is_less_smooth():
    speed = stroke(1.0, 100)
    shaken = speed * (1 + 0.5 * np.sin(2 * np.pi * 5 * np.linspace(0, 1, len(speed))))
    assert sparc(shaken, 100) < sparc(speed, 100) - 0.1
    assert log_dimensionless_jerk(shaken, 100) < log_dimensionless_jerk(speed, 100) - 1


@pytest.mark.parametrize("speed", [np.zeros(30), np.ones(4), np.r_[np.ones(20), np.nan]])
def test_no_smoothness_without_movement(speed):
    assert np.isnan(sparc(speed, 30))
    assert np.isnan(log_dimensionless_jerk(speed, 30))


def test_path_length_of_a_circle_with_a_gap():
    angle = 2 * np.pi * TIME[:301] / 10
    circle = 2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    assert path_length(circle, TIME) == (pytest.approx(4 * np.pi, rel=1e-4), pytest.approx(10))
    circle[100] = np.nan
    assert path_length(circle, TIME) == (
        pytest.approx(4 * np.pi * 298 / 300, rel=1e-4),
        pytest.approx(298 / 30),
    )
