"""Names of people: the same from frame to frame, through short gaps and past each other, never over a cut; who was out
of view and comes back is the same person by place, size and look, and not where it may be another."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from golden.detections import detected, scored
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.reading.load import read_video
from pcnet3d.pipeline.reading.people import Sighting, Tracker, first_names, may_be, rejoined


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


RED, BLUE = (200, 30, 30), (30, 30, 200)
AT = np.linspace([100, 60], [130, 120], 17, dtype=np.float32)


@pytest.fixture
def filmed(monkeypatch):
    """Tracks {name: (frames, colour, points (17, 2))} and the video that shows them."""

    def of(people):
        def images_at(video, frames):
            shown = {}
            for frame in frames:
                image = np.full((240, 320, 3), 90, np.uint8)
                for at, colour, points in people:
                    if frame in at:
                        (left, top), (right, bottom) = (
                            points.min(axis=0).astype(int),
                            points.max(axis=0).astype(int),
                        )
                        image[top:bottom, left:right] = colour
                shown[frame] = image
            return shown

        monkeypatch.setattr("pcnet3d.pipeline.reading.people.images_at", images_at)
        frames = np.concatenate([np.array(at) for at, _, _ in people])
        points = np.concatenate([np.tile(each, (len(at), 1, 1)) for at, _, each in people])
        names = np.repeat(np.arange(len(people)), [len(at) for at, _, _ in people])
        order = np.argsort(frames, kind="stable")
        found = detected(frames[order], scored(points[order]), names[order])
        return found.people(), Video(Path("film.mp4"), 320, 240, np.arange(frames.max() + 1) / 30, "h264")

    return of


@pytest.mark.parametrize(("colour", "again"), [(RED, True), (BLUE, False)])
def test_who_comes_back_after_two_seconds_is_the_same_person_by_the_look(filmed, colour, again):
    """74 of 192 frames were left out of a take that was called good: a man had been hidden for half a second."""
    tracks, video = filmed([(range(20), RED, AT), (range(80, 130), colour, AT + 30)])
    assert first_names(tracks, video) == {"0": "0", "1": "0" if again else "1"}
    people = rejoined([track.with_(time_s=None) for track in tracks], video)
    assert [len(one) for one in people] == ([70] if again else [20, 50])
    assert [[said.code for said in one.notices] for one in people] == (
        [["joined-again"]] if again else [[], []]
    )
    assert people[0].frame_index.tolist()[:21] == [*range(20), *([80] if again else [])]


def test_of_two_who_look_alike_nobody_is_joined(filmed):
    """Two players of a team: either may be the one who was lost."""
    tracks, video = filmed(
        [(range(20), RED, AT), (range(60, 90), RED, AT + 40), (range(70, 100), RED, AT - 40)]
    )
    assert first_names(tracks, video) == {name: name for name in "012"}


def test_who_is_lost_twice_has_one_name(filmed):
    tracks, video = filmed([(range(20), RED, AT), (range(60, 90), RED, AT), (range(130, 160), RED, AT)])
    assert set(first_names(tracks, video).values()) == {"0"}


@pytest.mark.data("video", "lifter")
def test_a_man_is_told_from_a_woman_by_the_images(data):
    man = np.load(data / "lifter" / "demo_man.npz")["movenet_kp2d"]
    woman = np.load(data / "lifter" / "walk_crop.npz")["movenet_kp2d"]
    woman = woman * [2, 2, 1] + [0, 394, 0]  # from the cut that was halved
    frames = np.concatenate([np.arange(45), np.arange(90, 143), np.arange(62, 89), np.arange(143, 160)])
    points = np.concatenate([man[:45], man[90:143], woman[:27], woman[81:98]])
    order = np.argsort(frames, kind="stable")
    names = np.repeat([0, 2, 1, 3], [45, 53, 27, 17])[order]
    tracks = detected(frames[order], points[order], names).people()
    video = read_video(data / "video" / "sports2d_demo.mp4")
    assert first_names(tracks, video) == {"0": "0", "1": "1", "2": "0", "3": "1"}


@pytest.mark.parametrize(
    ("last", "pace", "first", "again"),
    [
        ((100, 100), (0, 0), (130, 100), True),
        ((100, 215), (0, 2), (130, 100), False),  # went out below; a runner further up is another one
        ((100, 215), (0, 0), (130, 100), True),  # stood there, the feet out of the image
        ((100, 170), (0, 2), (130, 100), True),  # may have stopped
        ((10, 100), (-3, 0), (60, 100), False),  # went out on the left
        ((310, 100), (3, 0), (270, 100), False),
        ((100, 25), (0, -2), (100, 60), False),
        ((310, 230), (0, 0), (10, 10), True),
    ],
)
def test_who_went_out_of_the_image_is_nobody_who_is_in_it_later(last, pace, first, again):
    """Of a marathon: a runner who had left over the lower edge was said to be perhaps the next one."""
    until = np.arange(20)
    middle = np.concatenate([last + np.outer(until - 19, pace), np.tile(first, (20, 1))]).astype(np.float32)
    points = middle[:, None] + np.linspace([-15, -30], [15, 30], 17, dtype=np.float32)
    found = detected(np.concatenate([until, until + 60]), scored(points), np.repeat([0, 1], 20))
    assert may_be(*found.people(), (320, 240)) == again
    cut = replace(found, cuts=np.array([60]))  # two people of two scenes were said to be perhaps one
    assert not may_be(*cut.people(), (320, 240))


@pytest.mark.parametrize(("joint", "again"), [("wrist", True), ("ankle", False)])
def test_who_has_an_arm_up_is_no_larger(joint, again):
    """Who was lost with both arms up was nobody who was found later."""
    points = np.tile(np.linspace([100, 60], [130, 120], 17, dtype=np.float32), (40, 1, 1))
    points[:20, COCO17.index(f"r_{joint}")] = (115, 20) if joint == "wrist" else (115, 160)
    found = detected(np.r_[0:20, 40:60], scored(points), np.repeat([0, 1], 20))
    assert may_be(*found.people(), (320, 240)) == again
