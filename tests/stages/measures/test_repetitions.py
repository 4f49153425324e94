"""Repetitions of signals whose answers are known."""

import numpy as np
import pytest

from pcnet3d.stages.measures.figures import POINTS, normalised, symmetry
from pcnet3d.stages.measures.repetitions import near_ends_s, repetitions

FPS = 30
TIME = np.arange(10 * FPS + 1) / FPS
WAVES = 50 - 50 * np.cos(np.pi * TIME)  # five in ten seconds, 0 to 100


def stroke(seconds, fps):
    """Speed of one minimum-jerk movement (Flash & Hogan 1985), from rest to rest."""
    share = np.linspace(0, 1, round(seconds * fps) + 1)
    return 30 * share**2 * (1 - share) ** 2


def counted(x, time_s=TIME, least=40.0, seams=()):
    """Those that were seen to rise and return."""
    return [one for one in repetitions(x, time_s, least, seams) if min(one.seen) >= least]


def test_each_wave_is_a_repetition_with_its_times():
    found = counted(WAVES)
    assert len(found) == 5
    ends = np.arccos(0.86) / np.pi  # 50 - 50 cos(pi t) = 7
    for i, one in enumerate(found):
        assert one.start_s == pytest.approx(2 * i, abs=0.07)
        assert one.peak_s == pytest.approx(2 * i + 1)
        assert one.stop_s == pytest.approx(2 * i + 2 - ends, abs=2e-3)
        assert (one.peak, one.rise) == (pytest.approx(100), pytest.approx(100, abs=0.5))
        assert one.whole


def test_who_begins_and_ends_on_a_seat_sits_down_once_less_than_they_rise():
    assert [min(one.seen) >= 40 for one in repetitions(100 - WAVES, TIME, 40)] == [False, *[True] * 4, False]


def test_a_repetition_that_begins_and_ends_higher_is_as_much_shorter():
    one = counted(WAVES)[2]
    begins_s, ends_s = one.start_s - 4, 6 - one.stop_s
    starts, stops = (50 - 50 * np.cos(np.pi * at_s) for at_s in (begins_s, ends_s))
    shorter_s = sum(np.arccos(1 - (low + 10) / 50) / np.pi for low in (starts, stops)) - begins_s - ends_s
    assert near_ends_s(WAVES, TIME, one, 10) == pytest.approx(shorter_s, abs=3e-3)
    assert np.isnan(near_ends_s(WAVES, TIME, one, np.nan))


def test_a_dip_at_the_top_and_two_equal_tops_are_one_repetition():
    assert len(counted(np.minimum(WAVES, 80 - 10 * np.sin(4 * np.pi * TIME) ** 2))) == 5


def test_what_counts_is_the_height_above_the_lowest_and_the_rise_is_the_movement_s_own():
    """A knee's 24, 45, 31 and 64 degrees: docs/movements.md says so of a figure of 33 where bends count from 35."""
    (one,) = counted(np.interp(TIME, [0, 2, 4, 5, 7, 9, 10], [24, 24, 45, 31, 64, 24, 24]), least=35)
    assert (one.peak, one.rise) == (pytest.approx(64, abs=0.2), pytest.approx(33, abs=0.2))


@pytest.mark.parametrize("backwards", [False, True])
def test_one_that_a_take_begins_with_is_counted_once_and_cut(backwards):
    """It rises by 60 degrees in the take and falls by more: the part before the take is none of another."""
    x = np.where(TIME < 1, 40 + 60 * np.sin(np.pi * TIME / 2), 10 + 90 * np.clip(2 - TIME, 0, 1))
    (one,) = counted(x[::-1] if backwards else x)
    assert one.cut == ((False, True) if backwards else (True, False))


def test_a_return_that_settles_ends_before_the_drift():
    """Down to a tenth of the rise within a second, and from there slowly to the floor for three."""
    down = np.concatenate([np.linspace(100, 10, FPS), np.linspace(10, 0, 3 * FPS)])
    x = np.concatenate([np.zeros(FPS), np.linspace(0, 100, FPS), down])
    (one,) = counted(x, np.arange(len(x)) / FPS)
    assert one.stop_s == pytest.approx(3.0, abs=0.1)


def test_a_return_that_pauses_for_a_moment_goes_on():
    """Lifted knees pause for a frame or two: bends ended there, a quarter of a second early."""
    at_s, values = [0, 1, 2, 2.88, 2.95, 3.2, 4.2], [0, 0, 100, 14, 13, 0, 0]
    (one,) = counted(np.interp(TIME, at_s, values))
    assert one.stop_s == pytest.approx(2.95 + 0.25 * 6 / 13, abs=0.05)


def waves_without(*gaps):
    """The waves without these rows, of each gap its first and the row behind its last."""
    rows = np.concatenate([np.arange(*gap) for gap in gaps])
    return np.where(np.isin(np.arange(len(TIME)), rows), np.nan, WAVES)


@pytest.mark.parametrize(("first", "behind"), [(74, 80), (86, 93), (100, 110)])
def test_a_short_gap_leaves_the_repetition_without_what_it_hides(first, behind):
    """On the way up, at the top of 90 and on the way down, for a fifth of the wave at most."""
    found = counted(waves_without((first, behind)))
    assert len(found) == 5
    one, top = found[1], first < 90 < behind
    assert (one.start_s, one.stop_s) == (pytest.approx(2, abs=0.07), pytest.approx(3.83, abs=0.01))
    assert np.isnan(one.peak) == top
    assert one.whole == (not top)


def test_nothing_across_long_gaps_clip_boundaries_and_jumps_in_time():
    assert len(counted(waves_without((20, 40)), least=60)) == 4  # at the top of the first
    assert len(counted(WAVES, least=60, seams=(3 * FPS,))) == 4
    assert len(counted(WAVES, TIME + (TIME >= 5), 60)) == 4


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize(("first", "behind"), [(70, 95), (80, 100), (95, 120)])
def test_a_gap_that_cuts_a_repetition_leaves_a_part(first, behind, kept):
    """On the way up, at the top of 90 and on the way down; as rows without a value, or without rows."""
    gap = waves_without((first, behind))
    rows = np.isfinite(gap) | kept
    assert len(counted(gap[rows], TIME[rows])) == 4
    assert len(repetitions(gap[rows], TIME[rows], 40)) > 4


@pytest.mark.parametrize("kept", [True, False])
def test_a_repetition_whose_beginning_a_gap_hides_is_not_whole(kept):
    """It was a rise of 55 that took 1.4 s, of 100 in 1.6 s."""
    gap = waves_without((55, 74))  # from a twentieth on the way down to nearly half of the way up
    rows = np.isfinite(gap) | kept
    found = counted(gap[rows], TIME[rows])
    assert [one.whole for one in found] == [True, False, True, True, True]
    assert found[1].peak == pytest.approx(100)
    assert [one.whole for one in counted(WAVES[10:], TIME[10:])] == [False, True, True, True, True]


def test_a_hole_of_years_in_the_time_stamps_takes_no_memory():
    """Rows were once made for all of it."""
    assert len(counted(WAVES, TIME + 1e9 * (TIME >= 5), 60)) == 4
    assert repetitions(np.full(len(TIME), np.nan), TIME, 40) == []


def test_one_low_moment_before_a_rest_begins_nothing():
    """A knee straightened for a moment in the last step of a walk, and the squat after it began there: no squat, for
    the feet did not stay."""
    knee = np.concatenate(
        [15 - 9 * stroke(0.5, FPS) / 1.875, np.full(2 * FPS, 14.0), 14 + 0.8 * WAVES[: 2 * FPS + 1]]
    )
    (one,) = counted(knee, np.arange(len(knee)) / FPS, 35)
    assert one.start_s == pytest.approx(2.5, abs=0.15)


@pytest.mark.parametrize(("low", "start_s"), [(0, 1.35), (9, 2.0)])
def test_a_slow_start_is_no_rest(low, start_s):
    """A slow raise began nearly a second late. From 0 to 11.9 of 100 degrees in 1.6 s it rises, from 9 it rests."""
    (one,) = counted(np.interp(TIME, [0, 0.4, 2, 3, 4], [0, low, 11.9, 100, 0]))
    assert one.start_s == pytest.approx(start_s, abs=0.1)


@pytest.mark.parametrize("backwards", [False, True])
def test_what_stays_up_is_held_whether_its_begin_and_end_were_seen_or_not(backwards):
    """An arm went up at 5 s and stayed there until the take ended; it counted for nothing."""
    x = 10 + 100 * np.clip(TIME - 5, 0, 1)
    (one,) = repetitions(x[::-1] if backwards else x, TIME, 40)
    assert one.is_hold
    assert one.held_s == pytest.approx(4.15, abs=0.1)
    assert not any(one.is_hold for one in repetitions(10 + 100 * np.clip(TIME - 8, 0, 1), TIME, 40))


@pytest.mark.parametrize("seconds", [3, 6, 10])
def test_a_slow_movement_is_no_hold(seconds):
    """Arms that rose and sank for 8 s without a rest were "held for 3.0 s"."""
    (one,) = counted(10 + 140 * np.sin(np.pi * np.clip(TIME / seconds, 0, 1)) ** 2)
    assert not one.is_hold


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("held_s", np.arange(1.0, 5.0, 0.4))
def test_what_a_take_begins_with_is_a_repetition_or_a_hold(held_s, backwards):
    """A dancer's arm was on its way when the clip began, and was "raised at least once" and "held up once"."""
    x = np.interp(TIME, [0, 2.5, 2.5 + held_s, 4 + held_s, 5 + held_s], [60, 150, 152, 60, 15])
    assert len(repetitions(x[::-1] if backwards else x, TIME, 40)) == 1


def test_curves_over_a_cycle():
    spans = np.array([(0.0, 2.0), (2.0, 4.0), (4.5, 6.5)])
    curves = normalised(WAVES, TIME, spans)
    share = np.linspace(0, 1, POINTS)
    for curve, start in zip(curves, (0, 0, 0.5), strict=True):
        np.testing.assert_allclose(curve, 50 - 50 * np.cos(np.pi * (start + 2 * share)), atol=0.01)
    gap = WAVES.copy()
    gap[10] = np.nan
    assert len(normalised(gap, TIME, np.array([(0.0, 2.0), (2.0, 4.0), (9.0, 11.0)]))) == 1
    assert normalised(gap, TIME, np.zeros((0, 2))).shape == (0, POINTS)


def test_the_error_of_the_symmetry_index_is_that_of_draws():
    """Of a difference with an error of 3 whose sides share all others."""
    apart, shared = np.random.default_rng(0).normal(0, (3.0, 1.0), (20000, 2)).T
    sides = zip(60 + apart / 2 + shared, 45 - apart / 2 + shared, strict=True)
    off = np.std([symmetry(right, left, 0.0)[0].value for right, left in sides])
    (row,) = symmetry(60, 45, 3.0)
    assert row.error == pytest.approx(off, rel=0.03)
    assert row.within_error is False
    (unknown,) = symmetry(60, 45, np.nan)
    assert (unknown.error, unknown.within_error) == (None, None)


@pytest.mark.parametrize(("error", "key"), [(9.0, "symmetry_index"), (11.0, "symmetry_index_withheld")])
def test_a_difference_of_the_sides_is_withheld_where_twice_as_much_would_lie_within_its_error(error, key):
    """Right less left of a real take's thighs, in truth 13 %: "93 ± 69 %"."""
    assert [row.name for row in symmetry(40, 13, error)] == [key]
    assert [row.name for row in symmetry(40, 13, error, prefix="step_time_")] == [f"step_time_{key}"]
