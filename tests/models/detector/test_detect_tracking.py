"""Names of people: the same from frame to frame, through short gaps and past each other, never over a cut."""

import numpy as np
import pytest

from pcnet3d.models.detector.protocols import Found
from pcnet3d.models.detector.scene_cuts import Glance
from pcnet3d.models.detector.tracker import Sighting, Tracker


def person(x: float, y: float = 100, size: float = 50) -> Found:
    """Someone around a point."""
    xy = np.array([x, y]) + size * np.random.default_rng(0).uniform(-1, 1, (17, 2))
    return Found(xy, np.full(17, 0.8), np.concatenate([xy.min(0), xy.max(0)]))


def test_two_people_keep_their_names_whatever_the_order():
    tracker = Tracker()
    for frame in range(50):
        left, right = person(100 + 2 * frame), person(600 - 2 * frame, y=300)
        people, wanted = ([left, right], [0, 1]) if frame % 3 else ([right, left], [1, 0])
        if frame == 0:
            people, wanted = [left, right], [0, 1]
        assert tracker.names(frame, people) == wanted


def test_a_short_gap_is_bridged_and_a_long_one_is_not():
    tracker = Tracker()
    assert tracker.names(0, [person(100)]) == [0]
    assert tracker.names(30, [person(110)]) == [0]
    assert tracker.names(61, [person(110)]) == [1]


def test_all_are_joined_at_once():
    """Greedily the near one would take the place of the one who went on; together they fit."""
    tracker = Tracker()
    assert tracker.names(0, [person(100), person(160)]) == [0, 1]
    assert tracker.names(1, [person(155), person(215)]) == [0, 1]


def test_somebody_elsewhere_is_somebody_else():
    tracker = Tracker()
    assert tracker.names(0, [person(100)]) == [0]
    assert tracker.names(1, [person(400)]) == [1]
    assert tracker.names(2, [person(100), person(402), person(800)]) == [0, 1, 2]
    assert tracker.names(3, []) == []


def test_a_cut_makes_everybody_new():
    tracker = Tracker()
    assert tracker.names(0, [person(100)]) == [0]
    tracker.cut()
    assert tracker.names(1, [person(100)]) == [1]


def test_a_tracker_goes_on_from_last_sightings():
    known = [Sighting(0, 3, person(100)), Sighting(2, 9, person(400))]
    assert Tracker(known, people=5).names(10, [person(401), person(101), person(900)]) == [2, 0, 5]


@pytest.mark.parametrize("frames", [1, 3])
def test_cuts_and_what_is_none(toys, frames):
    here, moved = toys.scene((50, 50, 80, 150)), toys.scene((52 + frames, 50, 82 + frames, 150))
    other = toys.scene((50, 50, 80, 150), seed=3)
    a, b, c = Glance.at(here), Glance.at(moved), Glance.at(other)
    assert not a.is_cut_to(b)
    assert a.is_cut_to(c)
    assert not a.is_cut_to(Glance.at((here // 2 + 40).astype(np.uint8)))  # another exposure
    black = Glance.at(np.zeros_like(here))
    assert not a.is_cut_to(black)
    assert not black.shows
    assert a.shows
