"""The rise of a jump of lifted poses, by heights and by speed: a countermovement, a known fall, a landing on toes."""

import numpy as np
import pytest

from pcnet3d.models.place.flights import lifted_rise

FALL = 9.81 / 1.7  # statures / s2
TOES = 0.054  # statures by which standing on the toes lifts the ankles
# Statures: the body over the ankles, ankles over the floor, how far the knees give.
LEGS, ANKLE, DEEP = 0.5, 0.04, 0.2
APEX_S = 2.0


def jump(high: float, fps: float = 60.0, box: float = 0.0) -> dict:
    """Arguments of a jump so high, in statures: the body sinks, speeds up evenly, flies and lands likewise. box: how
    much higher it lands."""
    time_s = np.arange(0, 4, 1 / fps)
    up_s, down_s = np.sqrt(2 * high / FALL), np.sqrt(2 * (high - box) / FALL)
    leaves = LEGS + ANKLE + TOES
    push_s = 2 * (DEEP + TOES) / (FALL * up_s)
    way = time_s - APEX_S
    centre = leaves + high - FALL / 2 * way**2
    stretch = [np.clip((s - abs(way)) / push_s + 1, 0, 1) for s in (up_s, down_s)]  # 1 in the air
    lowest, floor = leaves - DEEP - TOES, np.where(way < 0, 0.0, box)
    pushing = lowest + (DEEP + TOES) * np.where(way < 0, *stretch) ** 2 + floor
    resting = abs(way) > np.where(way < 0, up_s, down_s) + push_s
    air = (-up_s < way) & (way < down_s)
    centre = np.where(air, centre, np.where(resting, LEGS + ANKLE + floor, pushing))
    toes = np.where(resting, 0.0, np.clip(centre - floor - LEGS - ANKLE, 0, TOES))
    ankle = np.where(air, centre - LEGS, ANKLE + floor + toes)
    rows = np.flatnonzero(air)
    return {
        "time_s": time_s, "centre": centre, "ankle": ankle, "stands": ~air, "rows": slice(rows[0], rows[-1] + 1),
        "off_s": APEX_S - up_s, "apex_s": APEX_S, "fall": FALL,
    }  # fmt: skip


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
@pytest.mark.parametrize("high", [0.06, 0.12, 0.25])
def test_a_known_jump_has_its_rise(high, fps):
    assert lifted_rise(**jump(high, fps)) == pytest.approx(high, abs=0.015)


def test_when_the_feet_leave_hardly_matters():
    """At the take-off 20 ms are 0.02 statures of the path."""
    one = jump(0.12)
    rises = [lifted_rise(**{**one, "off_s": one["off_s"] + late_s}) for late_s in (-0.02, 0.0, 0.02)]
    assert np.ptp(rises) < 0.004


def test_where_the_take_off_was_not_seen_heights_alone_tell():
    """The row before the take-off is in each line of 0.4 s from before it to the highest point."""
    one = jump(0.06)
    centre = one["centre"].copy()
    centre[one["rows"].start - 1] = np.nan
    seen, unseen = lifted_rise(**one), lifted_rise(**{**one, "centre": centre})
    assert seen != unseen
    assert unseen == pytest.approx(0.06, abs=0.005)


def test_onto_a_box_the_rise_is_over_the_floor_that_the_feet_leave():
    assert lifted_rise(**jump(0.3, box=0.2)) == pytest.approx(0.3, abs=0.025)
