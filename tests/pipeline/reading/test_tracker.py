"""Names of people: the same from frame to frame, through short gaps and past each other, never over a cut."""

import numpy as np

from pcnet3d.pipeline.reading.tracks import Sighting, Tracker


def person(frame: int, x: float, y: float = 100, size: float = 50) -> Sighting:
    """Someone around a point."""
    xy = np.array([x, y]) + size * np.random.default_rng(0).uniform(-1, 1, (17, 2))
    return Sighting(frame, xy, np.full(17, 0.8), np.concatenate([xy.min(0), xy.max(0)]))


def test_two_people_keep_their_names_whatever_the_order():
    tracker = Tracker()
    for frame in range(50):
        left, right = person(frame, 100 + 2 * frame), person(frame, 600 - 2 * frame, y=300)
        people, wanted = ([left, right], [0, 1]) if frame % 3 else ([right, left], [1, 0])
        if frame == 0:
            people, wanted = [left, right], [0, 1]
        assert tracker.names(people) == wanted


def test_a_short_gap_is_bridged_and_a_long_one_is_not():
    tracker = Tracker()
    assert tracker.names([person(0, 100)]) == [0]
    assert tracker.names([person(30, 110)]) == [0]
    assert tracker.names([person(61, 110)]) == [1]


def test_all_are_joined_at_once():
    """Greedily the near one would take the place of the one who went on; together they fit."""
    tracker = Tracker()
    assert tracker.names([person(0, 100), person(0, 160)]) == [0, 1]
    assert tracker.names([person(1, 155), person(1, 215)]) == [0, 1]


def test_somebody_elsewhere_is_somebody_else():
    tracker = Tracker()
    assert tracker.names([person(0, 100)]) == [0]
    assert tracker.names([person(1, 400)]) == [1]
    assert tracker.names([person(2, 100), person(2, 402), person(2, 800)]) == [0, 1, 2]
    assert tracker.names([]) == []


def test_who_passes_behind_somebody_goes_on_as_the_same():
    """Nothing but how they move tells two people of one size apart, of whom one is hidden where they meet."""
    tracker = Tracker()
    for frame in range(60):
        there, back = person(frame, 100 + 5 * frame), person(frame, 395 - 5 * frame)
        hidden = abs(frame - 30) < 8
        assert tracker.names([there] if hidden else [there, back]) == ([0] if hidden else [0, 1])


def test_a_cut_makes_everybody_new():
    tracker = Tracker()
    assert tracker.names([person(0, 100)]) == [0]
    tracker.cut()
    assert tracker.names([person(1, 100)]) == [1]


def test_a_tracker_goes_on_from_what_is_known():
    whole, later = Tracker(), Tracker()
    for frame in range(8):
        people = [person(frame, 100 + 10 * frame), person(frame, 400)]
        for name, sighting in zip(whole.names(people), people, strict=True):
            later.knows(name, sighting)
    # The first one has gone on to 280 meanwhile, nearer to where the other was than to where they were seen last.
    frame = [person(18, 281), person(18, 401), person(18, 900)]
    assert whole.names(frame) == later.names(frame) == [0, 1, 2]
