"""Repetitions and normalised curves of signals whose answers are known."""

import numpy as np
import pytest

from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD
from pcnet3d.stages.measures.cycles import (
    POINTS,
    comes_near,
    hiding,
    near_ends_s,
    normalised,
    repetitions,
    symmetry_index,
)
from pcnet3d.stages.measures.figures import symmetry

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
    ends = np.arccos(0.86) / np.pi  # 50 - 50 cos(pi t) = 7
    for i, one in enumerate(found):
        assert one.start_s == pytest.approx(2 * i, abs=0.07)
        assert one.peak_s == pytest.approx(2 * i + 1)
        assert one.stop_s == pytest.approx(2 * i + 2 - ends, abs=2e-3)
        assert (one.peak, one.rise) == (pytest.approx(100), pytest.approx(100, abs=0.5))


@pytest.mark.parametrize(
    ("error", "cut", "near"), [(15.0, True, True), (15.0, False, False), (5.0, True, False)]
)
def test_a_rise_that_is_seen_in_part_may_be_one_too_within_its_error(error, cut, near):
    """An arm that was still up when the clip ended had risen by 46 of the 50 degrees that count: "No raised arms"."""
    assert bool(comes_near(np.clip(60 * (TIME - 9), 0, 40), TIME, 50.0, error, cut=cut)) == near


def test_the_same_backwards():
    there, back = repetitions(WAVES, TIME, 40), repetitions(WAVES[::-1], TIME, 40)[::-1]
    np.testing.assert_allclose([10 - one.peak_s for one in back], [one.peak_s for one in there])
    np.testing.assert_allclose(sorted(one.start_s for one in back), [one.start_s for one in there], atol=2e-3)


def test_who_begins_and_ends_on_a_seat_sits_down_once_less_than_they_rise():
    assert len(repetitions(100 - WAVES, TIME, 40)) == 4


def test_a_repetition_that_begins_and_ends_higher_is_as_much_shorter():
    one = repetitions(WAVES, TIME, 40)[2]
    begins_s, ends_s = one.start_s - 4, 6 - one.stop_s
    starts, stops = (50 - 50 * np.cos(np.pi * at_s) for at_s in (begins_s, ends_s))
    shorter_s = sum(np.arccos(1 - (low + 10) / 50) / np.pi for low in (starts, stops)) - begins_s - ends_s
    assert near_ends_s(WAVES, TIME, one, 10) == pytest.approx(shorter_s, abs=3e-3)
    assert np.isnan(near_ends_s(WAVES, TIME, one, np.nan))


@pytest.mark.parametrize(("least", "count"), [(99, 5), (101, 0)])
def test_only_rises_that_are_high_enough(least, count):
    assert len(repetitions(WAVES, TIME, least)) == count


def test_a_dip_at_the_top_and_two_equal_tops_are_one_repetition():
    dipped = np.minimum(WAVES, 80 - 10 * np.sin(4 * np.pi * TIME) ** 2)
    assert len(repetitions(dipped, TIME, 40)) == 5


def test_what_counts_is_the_height_above_the_lowest_and_the_rise_is_the_movement_s_own():
    """A knee's 24, 45, 31 and 64 degrees: docs/movements.md says so of a figure of 33 where bends count from 35."""
    knee = np.interp(TIME, [0, 2, 4, 5, 7, 9, 10], [24, 24, 45, 31, 64, 24, 24])
    (one,) = repetitions(knee, TIME, 35)
    assert (one.peak, one.rise) == (pytest.approx(64, abs=0.2), pytest.approx(33, abs=0.2))


def test_a_rise_without_its_return_is_none():
    assert repetitions(WAVES[: FPS + 5], TIME[: FPS + 5], 40) == []
    assert repetitions(WAVES[FPS - 5 : 2 * FPS], TIME[FPS - 5 : 2 * FPS], 40) == []


def test_a_return_that_settles_ends_before_the_drift():
    """Down to a tenth of the rise within a second, and from there slowly to the floor for three."""
    down = np.concatenate([np.linspace(100, 10, FPS), np.linspace(10, 0, 3 * FPS)])
    x = np.concatenate([np.zeros(FPS), np.linspace(0, 100, FPS), down])
    (one,) = repetitions(x, np.arange(len(x)) / FPS, 40)
    assert one.stop_s == pytest.approx(3.0, abs=0.1)


def test_a_return_that_pauses_for_a_moment_goes_on():
    """Lifted knees pause for a frame or two: bends ended there, a quarter of a second early."""
    at_s, values = [0, 1, 2, 2.88, 2.95, 3.2, 4.2], [0, 0, 100, 14, 13, 0, 0]
    (one,) = repetitions(np.interp(TIME, at_s, values), TIME, 40)
    assert one.stop_s == pytest.approx(2.95 + 0.25 * 6 / 13, abs=0.05)


@pytest.mark.parametrize(("first", "behind"), [(74, 80), (86, 93), (100, 110)])
def test_a_short_gap_leaves_the_repetition_without_what_it_hides(first, behind):
    """On the way up, at the top of 90 and on the way down, for a fifth of the wave at most."""
    gap = waves_without((first, behind))
    found = repetitions(gap, TIME, 40)
    assert len(found) == 5
    one, top = found[1], first < 90 < behind
    assert (one.start_s, one.stop_s) == (pytest.approx(2, abs=0.07), pytest.approx(3.83, abs=0.01))
    assert np.isnan(one.peak) == top
    assert one.whole == (not top)
    assert hiding(gap, TIME, 40, briefest_s=1.2) == []


def test_nothing_across_long_gaps_clip_boundaries_and_jumps_in_time():
    assert len(repetitions(waves_without((20, 40)), TIME, 60)) == 4  # at the top of the first
    assert len(repetitions(WAVES, TIME, 60, seams=(3 * FPS,))) == 4
    assert len(repetitions(WAVES, TIME + (TIME >= 5), 60)) == 4


def waves_without(*gaps):
    """The waves without these rows, of each gap its first and the row behind its last."""
    rows = np.concatenate([np.arange(*gap) for gap in gaps])
    return np.where(np.isin(np.arange(len(TIME)), rows), np.nan, WAVES)


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize(("first", "behind"), [(70, 95), (80, 100), (95, 120), (65, 115)])
def test_a_gap_that_cuts_a_repetition_may_hide_one(first, behind, kept):
    """On the way up, at the top of 90 and on the way down; as rows without a value, or without rows."""
    gap, brief = waves_without((first, behind)), 0.8 * 1.59  # seconds that a wave is above its tenth
    rows = np.isfinite(gap) | kept
    assert len(repetitions(gap[rows], TIME[rows], 40)) == 4
    ((begin, end),) = hiding(gap[rows], TIME[rows], 40, briefest_s=brief)
    assert (begin, end) == (pytest.approx(TIME[first - 1]), pytest.approx(TIME[behind]))
    assert hiding(gap[rows], TIME[rows], 40, briefest_s=brief, counts=lambda one: one.start_s > 5) == []


def test_a_brief_gap_hides_a_rise_whose_ends_were_seen_however_brief_it_is():
    """An arm went from 19 to 98 degrees across four missing frames and back within a second: "No arm raises"."""
    x = np.interp(TIME, [4.0, 4.1, 4.3, 4.8], [19, 19, 98, 26])
    x[(TIME > 4.1) & (TIME < 4.3)] = np.nan
    assert not repetitions(x, TIME, 50)
    assert hiding(x, TIME, 50, briefest_s=1.6) == [
        (pytest.approx(4.1, abs=0.04), pytest.approx(4.3, abs=0.04))
    ]
    assert hiding(x, TIME, 50, briefest_s=1.6, counts=lambda one: False) == []
    assert hiding(x / 2, TIME, 50, briefest_s=1.6) == []


@pytest.mark.parametrize("kept", [True, False])
def test_a_repetition_whose_beginning_a_gap_hides_is_not_whole(kept):
    """It was a rise of 55 that took 1.4 s, of 100 in 1.6 s."""
    gap = waves_without((55, 74))  # from a twentieth on the way down to nearly half of the way up
    rows = np.isfinite(gap) | kept
    found = repetitions(gap[rows], TIME[rows], 40)
    assert [one.whole for one in found] == [True, False, True, True, True]
    assert found[1].peak == pytest.approx(100)
    backwards = repetitions(gap[rows][::-1], 10 - TIME[rows][::-1], 40)
    assert [one.whole for one in backwards] == [True, True, True, False, True]
    assert [one.whole for one in repetitions(WAVES[10:], TIME[10:], 40)] == [False, True, True, True, True]


def test_gaps_at_rest_and_clip_boundaries_hide_nothing():
    rest = waves_without((52, 70))  # about a valley at 60
    assert len(repetitions(rest, TIME, 40)) == 5
    assert hiding(rest, TIME, 40, briefest_s=1.2) == []
    assert hiding(WAVES, TIME, 40, seams=(3 * FPS,)) == []
    two = waves_without((80, 100), (172, 188), (262, 280))
    assert len(hiding(two, TIME, 40, briefest_s=1.2)) == 2  # at the tops of 90 and 270; a valley is at 180
    assert hiding(np.full(len(TIME), np.nan), TIME, 40) == []
    clips = np.where((TIME < 3) | (TIME > 9), 0.0, 60.0)  # of two clips: the rise is the seam
    clips[5 * FPS : 6 * FPS] = np.nan
    assert hiding(clips, TIME, 40, seams=(3 * FPS,)) == []
    assert len(hiding(clips, TIME, 40)) == 1


def test_one_low_moment_before_a_rest_begins_nothing():
    """A knee straightened for a moment in the last step of a walk, and the squat after it began there: no squat, for
    the feet did not stay."""
    knee = np.concatenate(
        [15 - 9 * stroke(0.5, FPS) / 1.875, np.full(2 * FPS, 14.0), 14 + 0.8 * WAVES[: 2 * FPS + 1]]
    )
    (one,) = repetitions(knee, np.arange(len(knee)) / FPS, 35)
    assert one.start_s == pytest.approx(2.5, abs=0.15)


@pytest.mark.parametrize(("low", "start_s"), [(0, 1.35), (9, 2.0)])
def test_a_slow_start_is_no_rest(low, start_s):
    """A slow raise began nearly a second late. From 0 to 11.9 of 100 degrees in 1.6 s it rises, from 9 it rests."""
    (one,) = repetitions(np.interp(TIME, [0, 0.4, 2, 3, 4], [0, low, 11.9, 100, 0]), TIME, 40)
    assert one.start_s == pytest.approx(start_s, abs=0.1)


def test_a_pause_on_the_way_up_is_part_of_the_movement():
    one = np.concatenate([np.zeros(FPS), np.cumsum(stroke(1, FPS)) / FPS, np.ones(FPS)])
    two = np.concatenate([one / 2, 0.5 + one[FPS:] / 2])
    paused = np.concatenate([two, two[::-1]]) * 90
    (broken,) = repetitions(paused, np.arange(len(paused)) / FPS, 40)
    assert broken.start_s == pytest.approx(1, abs=0.15)
    assert broken.rise == pytest.approx(90, abs=1)


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


def test_symmetry_index():
    assert symmetry_index(50, 50) == 0
    assert symmetry_index(60, 40) == pytest.approx(40)
    assert symmetry_index(40, 60) == pytest.approx(-40)
    assert np.isnan(symmetry_index(0, 0))


def test_the_error_of_the_symmetry_index_is_that_of_draws():
    """Of a difference with an error of 3 whose sides share all others."""
    apart, shared = np.random.default_rng(0).normal(0, (3.0, 1.0), (20000, 2)).T
    off = np.std([symmetry_index(60 + a / 2 + s, 45 - a / 2 + s) for a, s in zip(apart, shared, strict=True)])
    (row,) = symmetry(60, 45, 3.0)
    assert row.error == pytest.approx(off, rel=0.03)
    assert row.within_error is False
    (unknown,) = symmetry(60, 45, np.nan)
    assert (unknown.error, unknown.within_error) == (None, None)


@pytest.mark.parametrize(("error", "told"), [(9.0, "symmetry_index"), (11.0, "symmetry_outcome")])
def test_a_difference_of_the_sides_is_not_told_where_twice_as_much_would_lie_within_its_error(error, told):
    """Right less left of a real take's thighs, in truth 13 %: "93 ± 69 %"."""
    rows = symmetry(40, 13, error)
    assert [row.name for row in rows] == [told]
    if told == "symmetry_outcome":
        assert rows[0].text == CANNOT_BE_TOLD
    of_steps = [row.name for row in symmetry(40, 13, error, of="step_time_")]
    assert ("step_time_symmetry_reason" in of_steps) == (told == "symmetry_outcome")


def test_a_hole_of_years_in_the_time_stamps_may_hide_anything_and_takes_no_memory():
    """Rows were once made for all of it."""
    time_s = np.arange(60) / 30
    time_s[30:] += 1e9
    assert hiding(np.zeros(60), time_s, 20.0) == [(time_s[29], time_s[30])]
