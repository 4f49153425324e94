"""Names of people: the same from frame to frame, through short gaps and past each other, never over a cut."""

import numpy as np
import pytest

from pcnet3d.pipeline.signals.tracker import Sighting, Tracker, exchanges


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


@pytest.mark.parametrize(
    ("aside", "size", "told"), [(0.3, 1, True), (0.14, 1.4, True), (0.14, 1, False), (0, 1.4, False)]
)
@pytest.mark.parametrize("lasts", [1, 20])
def test_who_goes_on_elsewhere_is_somebody_else(aside, size, told, lasts):
    """Of two who cross a detector followed now one and now the other, and the page spoke of one. A frame in which it is
    lost is no other person, nor is who jumps aside or is taken for larger on the spot."""
    points = np.stack([person(frame, 100 + frame).points for frame in range(40)])
    there = slice(20, 20 + lasts)
    middle = points[there].mean(axis=1, keepdims=True)
    away = (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    points[there] = middle + size * (points[there] - middle) + away
    points[:, 3] = points[5] = np.nan
    assert [row for row, _ in exchanges(np.arange(40) / 30, points)] == [20] * (told and lasts > 1)


@pytest.mark.parametrize(("aside", "told"), [(0.6, True), (0.2, False)])
def test_who_goes_on_elsewhere_is_somebody_else_at_ten_frames_a_second_too(aside, told):
    """Three men one after the other were one person: a quarter of a second had too few frames to show where he went."""
    points = np.stack([person(frame, 100 + frame).points for frame in range(40)])
    points[20:] += (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    assert [row for row, _ in exchanges(np.arange(40) / 10, points)] == [20] * told


def test_who_is_seen_with_more_of_the_body_is_nobody_else():
    """A woman to the hips turned, and more joints of hers were seen: she went on as another person."""
    points = np.stack([person(frame, 100 + frame).points for frame in range(40)])
    size = np.linalg.norm(np.ptp(points[0], axis=0))
    points[:, 13:] += (0, size)
    points[20:, :13] = points[20:, 12::-1]
    points[:20, 13:] = np.nan
    assert not exchanges(np.arange(40) / 30, points)
