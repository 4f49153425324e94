"""Cuts within a scene are found by what leaps in the image and in somebody's joints at once; where somebody else goes
on, by where the track was going."""

from dataclasses import replace

import numpy as np
import pytest

from golden.detections import detected, scored
from pcnet3d.models.detector.leaps import exchanges, leaps
from pcnet3d.models.detector.video import _told_apart
from pcnet3d.pipeline.reading.choose import choose_detected

FRAMES, CUT = np.arange(60), 30


def filmed(lengthened: float, arm: float, change: float, lasts: int = 60):
    """Somebody who moves a little; from the cut on larger, and with an arm elsewhere, in body sizes. change: of the
    image at the cut, in grey values."""
    body = np.random.default_rng(0).uniform(0, 200, (17, 2))
    points = body + 2 * np.sin(0.3 * FRAMES)[:, None, None] + 300
    there = slice(CUT, CUT + lasts)
    middle = points[there].mean(axis=1, keepdims=True)
    points[there] = middle + lengthened * (points[there] - middle)
    points[there, 7:11] += arm * 280
    found = detected(FRAMES, scored(points), np.zeros(60, int))
    changes = np.full(60, 16.0)
    changes[0], changes[CUT] = np.nan, change
    return replace(found, change=changes, frames=60, frames_seen=60)


@pytest.mark.parametrize(
    ("lengthened", "arm", "change", "told"),
    [
        (1.3, 0.0, 60.0, True),  # an editor enlarges the picture: "camera stands still", the pelvis travelled
        (1 / 1.3, 0.0, 60.0, True),
        (1.0, 0.4, 55.0, True),  # two seconds were cut out: "the poses are good"
        (1.0, 0.4, 18.0, False),  # a keypoint is lost, or an arm is quick
        (1.0, 0.0, 200.0, False),  # a picture beside the person changes, or a light
    ],
)
def test_what_leaps_in_the_image_and_in_the_body_is_a_cut(lengthened, arm, change, told):
    found = filmed(lengthened, arm, change)
    assert leaps(found).tolist() == [CUT] * told
    apart = _told_apart(found)
    assert apart.cuts.tolist() == [CUT] * told
    assert [len(one) for one in apart.people()] == ([30, 30] if told else [60])
    assert [one.code for one in apart.doubts(apart.people()[0]) if one.code == "scene-changes"] == [
        "scene-changes"
    ] * told


@pytest.mark.parametrize(
    ("ends", "begins", "cuts", "told"),
    [
        (30, 30, [], True),
        (30, 30, [30], False),
        (30, 33, [], False),
        (55, 55, [], False),  # who is lost is seen elsewhere for a moment
    ],
)
def test_where_one_track_ends_another_begins_is_said(ends, begins, cuts, told):
    """A walk with half a second cut out was of two people, of whom the page took the second without a word."""
    frames = np.r_[0:ends, begins:60]
    points = scored(np.random.default_rng(0).uniform(0, 200, (len(frames), 17, 2)))
    found = detected(frames, points, (np.arange(len(frames)) >= ends).astype(int))
    people = replace(found, cuts=np.array(cuts, np.int64)).people()
    for person in ("0", "1") if told else ("0",):
        said = choose_detected(people, person, "").notices
        assert [each.values["frame"] for each in said if each.code == "cut-or-another"] == [30] * told


@pytest.mark.parametrize(("joints", "told"), [(17, True), (2, False)])
def test_who_comes_back_where_another_is_lost_may_be_the_other(joints, told):
    """Of two joints nobody can tell; the distance was taken for none."""
    frames, person = np.r_[0:20, 22:60], np.r_[[0] * 20, [1] * 8, [0] * 30]
    points = np.random.default_rng(0).uniform(0, 200, (17, 2)) + np.zeros((58, 1, 1))
    points[20:] += 900 + 0.1 * np.arange(38)[:, None, None]
    points[:, joints:] = np.nan
    said = choose_detected(detected(frames, scored(points), person).people(), "0", "").notices
    assert [each.values["frame"] for each in said if each.code == "leap-between-people"] == [30] * told


def walking_on(frame: int) -> np.ndarray:
    """(17, 2) joints of somebody who moves a pixel a frame."""
    return np.array([100.0 + frame, 100.0]) + 50 * np.random.default_rng(0).uniform(-1, 1, (17, 2))


@pytest.mark.parametrize(
    ("aside", "size", "told"), [(0.3, 1, True), (0.14, 1.4, True), (0.14, 1, False), (0, 1.4, False)]
)
@pytest.mark.parametrize("lasts", [1, 20])
def test_who_goes_on_elsewhere_is_somebody_else(aside, size, told, lasts):
    """Of two who cross a detector followed now one and now the other, and the page spoke of one. A frame in which it is
    lost is no other person, nor is who jumps aside or is taken for larger on the spot."""
    points = np.stack([walking_on(frame) for frame in range(40)])
    there = slice(20, 20 + lasts)
    middle = points[there].mean(axis=1, keepdims=True)
    away = (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    points[there] = middle + size * (points[there] - middle) + away
    points[:, 3] = points[5] = np.nan
    assert [row for row, _ in exchanges(np.arange(40) / 30, points)] == [20] * (told and lasts > 1)


@pytest.mark.parametrize(("aside", "told"), [(0.6, True), (0.2, False)])
def test_who_goes_on_elsewhere_is_somebody_else_at_ten_frames_a_second_too(aside, told):
    """Three men one after the other were one person: a quarter of a second had too few frames to show where he went."""
    points = np.stack([walking_on(frame) for frame in range(40)])
    points[20:] += (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    assert [row for row, _ in exchanges(np.arange(40) / 10, points)] == [20] * told


def test_who_is_seen_with_more_of_the_body_is_nobody_else():
    """A woman to the hips turned, and more joints of hers were seen: she went on as another person."""
    points = np.stack([walking_on(frame) for frame in range(40)])
    size = np.linalg.norm(np.ptp(points[0], axis=0))
    points[:, 13:] += (0, size)
    points[20:, :13] = points[20:, 12::-1]
    points[:20, 13:] = np.nan
    assert not exchanges(np.arange(40) / 30, points)
