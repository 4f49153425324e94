"""Moments that a page shows, of measures that are made here."""

from dataclasses import replace

from pcnet3d.pipeline.core.measures import Measure, Measures, Moments
from pcnet3d.stages.report.events import Event, chosen_events, event_beside, moments_of


def events(take, most: int) -> list[Event]:
    return chosen_events(moments_of(take), take.need("poses").times, most)


def test_a_flight_belongs_to_the_jump_of_its_number(walk_take):
    times = walk_take.need("poses").times
    first_s, second_s, flight_s = float(times[5]), float(times[-10]), 2 * float(times[3] - times[0])
    rows = (
        Moments("start", (first_s, second_s), group=("jumps",)),
        Measure("flight_time", 3 * flight_s, number=0, group=("jumps",)),
        Measure("flight_time", flight_s, number=1, group=("jumps",)),
    )
    shown = events(replace(walk_take, measures=Measures(rows)), most=6)
    assert [event.row for event in shown] == [14, len(times) - 7]


def test_the_one_picture_of_raised_arms_is_of_the_highest_raise(walk_take):
    times = walk_take.need("poses").times
    low, high = len(times) // 4, 3 * len(times) // 4
    group = ("arm_raises", "right")
    moments = Moments("peak_at", (float(times[low]), float(times[high])), group=group)
    peaks = [Measure("peak", peak, number=i, group=group) for i, peak in enumerate((100, 150))]
    take = replace(walk_take, measures=Measures((moments, *peaks)))
    (shown,) = events(take, most=1)
    assert (shown.row, shown.words) == (high, "right arm raised 150°")
    assert [event.row for event in events(take, most=2)] == [low, high]
    # An arm "raised to between 144 and 152 degrees" was shown at 168, beside a gap that hid how high it came.
    assert [event.row for event in events(replace(take, measures=Measures((moments, peaks[0]))), most=2)] == [
        low
    ]


def test_every_frame_at_a_landing_is_called_one_with_the_time_that_was_measured(walk_take):
    """Of six pictures two were called landings, and two of the others showed one."""
    times = walk_take.need("poses").times
    rows = [10, 20, 30, 40]
    at_s = [float(times[row] + 0.4 * (times[row + 1] - times[row])) for row in rows]
    landings = [
        Moments("landings", tuple(at_s[i::2]), group=("walking", side))
        for i, side in enumerate(("right", "left"))
    ]
    take = replace(walk_take, measures=Measures(tuple(landings)))
    assert [event.row for event in events(take, most=6)] == [30, 40]
    for row, moment_s in zip(rows, at_s, strict=True):
        for beside in (row - 1, row, row + 1):
            event = event_beside(moments_of(take), beside)
            assert (event.row, event.at_s) == (row, moment_s)
    assert event_beside(moments_of(take), 25) == Event(25, "")
