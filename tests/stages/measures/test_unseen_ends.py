"""What a take does not show at its beginning and its end: gaps there, and postures that are held beyond them."""

import numpy as np
import pytest

from pcnet3d.pipeline.core.measures import CANNOT_BE_TOLD, NONE, nested
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.cycles import hiding, unreturned
from pcnet3d.stages.measures.movements import BEND
from pcnet3d.stages.measures.outcomes import BRIEFEST_S, with_outcome
from pcnet3d.stages.measures.repeats import COUNTS, OTHER, repeats
from pcnet3d.stages.measures.walking import _hidden

FPS = 30
TIME = np.arange(12 * FPS) / FPS
REST = 10 + np.sin(TIME)


def bends(x, judged=lambda one: COUNTS, sd_deg=np.nan):
    """The group `knee_bends` of a knee angle (T,). sd_deg: also (T,)."""
    sd = np.full(len(TIME), sd_deg)
    columns = Columns({"x_deg": x}, TIME, (), bool(np.isfinite(sd).all()))
    rows = repeats(columns, "knee_flexion", x, sd, BEND, [], judged, BRIEFEST_S["knee_bends"])
    return nested(with_outcome("knee_bends", rows, TIME[-1]))


@pytest.mark.parametrize("unseen", [TIME < 5, TIME > 7, (TIME > 4) & (TIME < 8)])
def test_who_stands_still_before_or_after_a_long_gap_may_have_moved_in_it(unseen):
    """The first 42 % of the frames were not seen, and the page said that there were no knee bends."""
    found = bends(np.where(unseen, np.nan, REST))
    assert (found["outcome"], found["count"]) == (CANNOT_BE_TOLD, 0)
    assert found["reason"].startswith("the angle is not known from")


@pytest.mark.parametrize("unseen", [TIME < 0, TIME < 0.3, TIME > 11.6, (TIME > 4) & (TIME < 4.3)])
def test_no_movement_fits_into_a_moment(unseen):
    assert bends(np.where(unseen, np.nan, REST))["outcome"] == NONE


@pytest.mark.parametrize(("until_s", "outcome"), [(8.5, CANNOT_BE_TOLD), (6.5, NONE)])
def test_who_walks_into_a_gap_may_do_something_else_in_it(until_s, outcome):
    """Somebody walked for 1.6 s, the legs were out of the image for as long, and the page said that there were no knee
    bends, because the feet moved when the legs were last seen."""
    walks = np.where(TIME < 6, 30 - 25 * np.cos(2 * np.pi * TIME), 10)
    x = np.where((TIME > 5.8) & (until_s > TIME), np.nan, walks)
    found = bends(x, judged=lambda one: COUNTS if one.start_s > 5.5 else OTHER)
    assert (found["outcome"], found["count"]) == (outcome, 0)


def test_gaps_at_both_ends_are_told_from_the_first_row_to_the_last():
    x = np.where((TIME < 3) | (TIME > 8), np.nan, 50 + 50 * np.cos(np.pi * TIME))
    assert hiding(x, TIME, 40, briefest_s=1.0) == [(0, TIME[90]), (TIME[240], TIME[-1])]


@pytest.mark.parametrize("backwards", [False, True])
def test_a_hold_to_the_end_of_the_take_is_a_hold(backwards):
    """An arm went up at 5 s and stayed there until the take ended at 12 s; it counted for nothing."""
    x = 10 + 100 * np.clip(TIME - 5, 0, 1)
    found = bends(x[::-1] if backwards else x)
    holds = found["holds"]
    assert (found["count"], holds["count"]) == (0, 1)
    assert holds["longest_s"] == pytest.approx(6.15, abs=0.1)
    assert holds["longest_reason"]
    rest_s = (TIME[-1] - holds["stop_s"][0]) if backwards else holds["start_s"][0]
    assert rest_s == pytest.approx(5.85, abs=0.1)


@pytest.mark.parametrize("sd_deg", [4.0, 25.0])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_return_as_uncertain_as_it_is_large_is_not_sure(backwards, sd_deg):
    """A hand went to the other shoulder and stayed: its elbow was at 80 degrees, stated as 28 give or take 40, and the
    arm was raised "twice"."""
    x = np.interp(TIME, [0, 1, 2, 3, 6, 8, 8.2, 12], [15, 15, 120, 15, 15, 70, 20, 22])
    sd = np.where(TIME > 8, sd_deg, 4.0)
    found = bends(x[::-1], sd_deg=sd[::-1]) if backwards else bends(x, sd_deg=sd)
    assert (found["count"], "count_reason" in found) == ((2, False) if sd_deg < 10 else (1, True))


@pytest.mark.parametrize("backwards", [False, True])
def test_a_rise_that_the_take_ends_in_is_not_none(backwards):
    """An arm went up by 60 degrees until the take ended, and the page said that no arm was raised."""
    x = 10 + 60 * np.clip(TIME - 11, 0, 1)
    found = bends(x[::-1] if backwards else x)
    assert (found["outcome"], found["count"]) == (CANNOT_BE_TOLD, 0)


@pytest.mark.parametrize("backwards", [False, True])
def test_beside_whole_ones_a_part_at_an_end_is_told(backwards):
    """A skater came into the take with an arm up, raised it twice more, and had raised it "twice"."""
    whole = 80 * np.sin(np.pi * np.clip(TIME - 3, 0, 2) / 2)
    x = 10 + whole + 80 * np.clip(TIME - 11, 0, 1)
    found = bends(x[::-1] if backwards else x)
    assert found["count"] == 1
    assert found["count_reason"].startswith("only part of another was seen, at ")
    assert "count_reason" not in bends(10 + whole)
    small = 10 + whole + 0.3 * (x - 10 - whole)  # at the end it changes by less than what counts
    assert "count_reason" not in bends(small)
    begun = bends(
        10 + 2 * whole + 60 * np.clip(TIME - 11, 0, 1)
    )  # less than half of the other, as far as it was seen
    assert begun["count"] == 1
    assert "count_reason" in begun


@pytest.mark.parametrize("backwards", [False, True])
def test_one_that_a_take_begins_with_is_counted_once(backwards):
    """It rises by 60 degrees in the take and falls by more: the part before the take is none of another."""
    x = np.where(TIME < 1, 40 + 60 * np.sin(np.pi * TIME / 2), 10 + 90 * np.clip(2 - TIME, 0, 1))
    found = bends(x[::-1] if backwards else x)
    assert found["count"] == 1
    assert found["count_reason"].startswith("only part of one was seen, at ")
    assert "mean_rise_deg" not in found  # nobody saw all of it


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("held_s", np.arange(1.0, 5.0, 0.2))
def test_what_a_take_begins_with_is_a_repetition_or_a_hold(held_s, backwards):
    """A dancer's arm was on its way when the clip began, and was "raised at least once" and "held up once"."""
    x = np.interp(TIME, [0, 2.5, 2.5 + held_s, 4 + held_s, 5 + held_s], [60, 150, 152, 60, 15])
    found = bends(x[::-1] if backwards else x)
    assert found["count"] + found.get("holds", {"count": 0})["count"] == 1


@pytest.mark.parametrize("seconds", [3, 6, 12])
def test_a_slow_movement_is_no_hold(seconds):
    """Arms that rose and sank for 8 s without a rest were "held for 3.0 s"."""
    found = bends(10 + 140 * np.sin(np.pi * np.clip(TIME / seconds, 0, 1)) ** 2)
    assert (found["count"], "holds" in found) == (1, False)


def test_a_part_at_an_end_is_told_beside_a_near_miss():
    """The arms rose by 110 degrees until the clip ended: "it is uncertain whether an angle rises by 50 degrees"."""
    near, part = 28 * np.sin(np.pi * np.clip(TIME - 3, 0, 1)), 110 * np.clip(TIME - 11, 0, 1)
    found = bends(10 + near + part, sd_deg=8.0)
    assert (found["outcome"], found["count"]) == (CANNOT_BE_TOLD, 0)
    assert found["reason"] == bends(10 + part, sd_deg=8.0)["reason"] != bends(10 + near, sd_deg=8.0)["reason"]
    beside = bends(10 + near + 110 * np.sin(np.pi * np.clip(TIME - 6, 0, 2) / 2), sd_deg=8.0)
    assert (beside["count"], "count_reason" in beside) == (1, False)  # a near miss beside another is none


def test_one_that_counts_is_not_doubted_too():
    """A raise was counted from 14.30 to 18.97 s, and what was seen from 14.42 to 18.92 s "may be no raise"."""
    x = 10 + 110 * np.sin(np.pi * np.clip(TIME - 3, 0, 4) / 4)
    x[(TIME > 5.6) & (TIME < 6.2)] = np.nan
    found = bends(x, lambda one: "from {}" if 5.6 < one.peak_s < 6.2 else COUNTS)
    assert (found["count"], "count_reason" in found) == (1, False)


@pytest.mark.parametrize(("dip", "outcome"), [(44, CANNOT_BE_TOLD), (40, "seen")])
def test_two_small_rises_are_no_large_one(dip, outcome):
    """A seated pianist whose legs swayed by 19 degrees "bent the knees once", since they had been straighter before."""
    x = np.interp(TIME, [2, 4, 5, 6, 9], [20, 58, dip, 70, 20])
    found = bends(x, sd_deg=1.0)
    assert found["outcome"] == outcome
    assert found["count"] == (outcome == "seen")


def test_a_hold_beside_whole_ones_is_no_part_of_another():
    """It is told as a hold."""
    found = bends(10 + 80 * np.sin(np.pi * np.clip(TIME - 1, 0, 2) / 2) + 80 * np.clip(TIME - 5, 0, 1))
    assert (found["count"], found["holds"]["count"]) == (1, 1)
    assert "count_reason" not in found


def test_of_two_holds_the_longest_was_seen_whole():
    x = 10 + 100 * np.clip(np.minimum(TIME, 6 - TIME), 0, 1) + 100 * np.clip(TIME - 7, 0, 1)
    x[: FPS // 2] = 10
    holds = bends(x)["holds"]
    assert holds["count"] == 2
    assert "longest_reason" not in bends(np.where(TIME < 11, x, np.nan))["holds"]


def test_a_rise_at_the_end_is_no_hold_and_rest_no_rise():
    assert "holds" not in bends(10 + 100 * np.clip(TIME - 10, 0, 1))
    assert unreturned(REST, TIME, BEND) == []
    assert unreturned(np.full(len(TIME), np.nan), TIME, BEND) == []


def test_legs_that_are_not_seen_for_long_before_the_first_frame_may_have_walked():
    apart = np.zeros(len(TIME))
    assert _hidden(apart, TIME) == ""
    assert "0.00 to 5.00 s" in _hidden(np.where(TIME < 5, np.nan, apart), TIME)
    assert _hidden(np.where(TIME < 0.5, np.nan, apart), TIME) == ""


def test_a_lifted_duration_is_no_surer_than_where_a_movement_begins():
    """Of raises that were stated to within 0.17 s, 57 % were: steep ends say nothing of a swing before the raise."""
    steep = 80.0 * (np.abs(TIME - 2) < 0.5)
    assert bends(steep, sd_deg=4.0)["mean_duration_error_s"] >= 0.15
