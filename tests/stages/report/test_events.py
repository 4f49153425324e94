"""Moments that a page shows, of measures that are made here."""

from dataclasses import replace

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
