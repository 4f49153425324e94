"""Moments that a page shows, of measures that are made here."""

from dataclasses import replace

import numpy as np

from pcnet3d.pipeline.core.measures import Measure, Moments
from pcnet3d.stages.report.events import events


def test_a_flight_belongs_to_the_jump_of_its_number(walk_take):
    times = walk_take.need("poses").times
    first_s, second_s, flight_s = float(times[5]), float(times[-10]), 2 * float(times[3] - times[0])
    rows = (
        Moments("start", (first_s, second_s), group=("jumps",)),
        Measure("flight_time", flight_s, "s", number=1, group=("jumps",)),
    )
    shown = events(replace(walk_take, measures=rows), most=6)
    assert [event.row for event in shown] == [len(times) - 7]


def test_the_one_picture_of_raised_arms_is_of_the_highest_raise(walk_take):
    times = walk_take.need("poses").times
    low, high = len(times) // 4, 3 * len(times) // 4
    elevation = 20.0 + 80 * (np.arange(len(times)) == low) + 130 * (np.arange(len(times)) == high)
    middle_s = float(times[len(times) // 2])
    rows = (
        Moments("start", (float(times[0]), middle_s), group=("arm_raises", "right")),
        Moments("stop", (middle_s, float(times[-1])), group=("arm_raises", "right")),
    )
    kinematics = {**(walk_take.kinematics or {}), "r_shoulder_elevation_deg": elevation}
    take = replace(walk_take, measures=rows, kinematics=kinematics)
    assert [event.row for event in events(take, most=1)] == [high]
    assert [event.row for event in events(take, most=2)] == [low, high]
