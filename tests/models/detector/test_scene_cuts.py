"""Where a video goes on with another scene, or a track with somebody else: by the image, by what leaps in it and in the
joints at once, and by where the track was going."""

from dataclasses import replace

import numpy as np
import pytest

from golden.detections import detected, scored
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.scene_cuts import Glance, exchanges, leaps
from pcnet3d.models.detector.video import _told_apart, detect
from pcnet3d.pipeline.reading.people import choose_detected


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


def test_somebody_who_comes_near_while_images_are_missing_is_in_the_same_room(toys):
    """A dark person over two fifths of the image."""
    here = toys.scene((50, 50, 80, 150))
    near = here.copy()
    near[:, : int(0.4 * here.shape[1])] = 10
    assert not Glance.at(here).is_cut_to(Glance.at(near))


@pytest.mark.parametrize(("post", "step"), [(None, 60), (20, 36), (240, 60)])
@pytest.mark.parametrize("other", [False, True])
def test_a_fast_pan_past_a_post_is_no_cut(toys, post, step, other):
    """By a twentieth of the width and more a frame; a cut past the same post and to the same caption is one."""
    wall = _wall(toys)

    def image(left: int, post_at: int) -> np.ndarray:
        shown = wall[:, left : left + 600].copy()
        if post is not None:
            shown[:, post_at : post_at + 120] = post
        shown[200:230, 50:550:40] = 255
        return shown

    before, behind = Glance.at(image(0, 400)), Glance.at(image(900 if other else step, 400 - 2 * step))
    assert before.is_cut_to(behind) == other


def test_a_picture_that_an_editor_shifts_is_cut(toys):
    """By half of its width, further than a camera turns from an image to the next."""
    wall = _wall(toys)
    assert Glance.at(wall[:, :600]).is_cut_to(Glance.at(wall[:, 300:900]))


def _wall(toys) -> np.ndarray:
    """(240, 1600, 3) with something to see everywhere."""
    wall = toys.scene(None, (1600, 240), seed=1)
    grain = np.random.default_rng(2).integers(-40, 40, (24, 160, 1)).repeat(10, axis=0).repeat(10, axis=1)
    return np.clip(wall + grain, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("bars", [np.s_[:30, :], np.s_[:, :100]], ids=["above and below", "at the sides"])
def test_black_bars_hide_no_cut_and_make_none(toys, bars):
    def barred(image: np.ndarray) -> Glance:
        image = image.copy()
        image[bars] = image[::-1, ::-1][bars] = 0
        return Glance.at(image)

    here = barred(toys.scene((150, 50, 180, 150)))
    assert here.is_cut_to(barred(toys.scene((150, 50, 180, 150), seed=3)))
    assert not here.is_cut_to(barred(toys.scene((154, 50, 184, 150))))
    assert not here.is_cut_to(barred(toys.scene((150, 50, 180, 150)) // 2))


def _lit(toys, left: int = 130, person: bool = True) -> np.ndarray:
    """(240, 320, 3) a room that is lightest in the middle, where somebody stands."""
    light = 150 * np.exp(-2 * np.linspace(-1, 1, 320) ** 2)
    image = np.clip(toys.scene(None) // 2 + light[:, None], 0, 255).astype(np.uint8)
    if person:
        image[60:220, left : left + 60] = (250, 10, 10)
    return image


def test_a_mirrored_film_of_who_stands_alike_is_cut(toys, toy, film):
    """From there on right was left, and the raises of one arm were counted for the other."""
    here = _lit(toys)
    before, quiet, moves = Glance.at(here), 4.0, 80.0
    there = Glance.at(here[:, ::-1])
    assert before.is_cut_to(there, quiet)
    assert not before.is_cut_to(there, moves)
    subtitle = here.copy()
    subtitle[190:230, 40:280:8] = 255
    brighter = np.clip(1.6 * here + 60, 0, 255).astype(np.uint8)
    for same in (subtitle, brighter, here // 3, np.roll(here, 5, axis=1)):
        assert not before.is_cut_to(Glance.at(same), quiet)
    found = detect(film([*[here] * 12, *[here[:, ::-1]] * 12]), load_detector(toy))
    assert found.cuts.tolist() == [12]
    assert [len(one) for one in found.people()] == [12, 12]


def test_a_camera_that_turns_takes_more_along_than_the_person(toys):
    """Behind a cut somebody stood a little further to the side, and five patches of the image on them."""
    body = (
        np.random.default_rng(0).integers(0, 255, (16, 12, 1), np.uint8).repeat(10, axis=0).repeat(10, axis=1)
    )

    def filmed(seed: int, left: int) -> Glance:
        image = toys.scene(None, seed=seed)
        image[50:210, left : left + 120] = body
        return Glance.at(image)

    assert filmed(0, 140).is_cut_to(filmed(3, 147))


FRAMES, CUT = np.arange(60), 30


def leaping(lengthened: float, arm: float, change: float, lasts: int = 60):
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
    found = leaping(lengthened, arm, change)
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


def going_on(frame: int) -> np.ndarray:
    """(17, 2) joints of somebody who moves a pixel a frame."""
    return np.array([100.0 + frame, 100.0]) + 50 * np.random.default_rng(0).uniform(-1, 1, (17, 2))


@pytest.mark.parametrize(
    ("aside", "size", "told"), [(0.3, 1, True), (0.14, 1.4, True), (0.14, 1, False), (0, 1.4, False)]
)
@pytest.mark.parametrize("lasts", [1, 20])
def test_who_goes_on_elsewhere_is_somebody_else(aside, size, told, lasts):
    """Of two who cross a detector followed now one and now the other, and the page spoke of one. A frame in which it is
    lost is no other person, nor is who jumps aside or is taken for larger on the spot."""
    points = np.stack([going_on(frame) for frame in range(40)])
    there = slice(20, 20 + lasts)
    middle = points[there].mean(axis=1, keepdims=True)
    away = (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    points[there] = middle + size * (points[there] - middle) + away
    points[:, 3] = points[5] = np.nan
    assert [row for row, _ in exchanges(np.arange(40) / 30, points)] == [20] * (told and lasts > 1)


@pytest.mark.parametrize(("aside", "told"), [(0.6, True), (0.2, False)])
def test_who_goes_on_elsewhere_is_somebody_else_at_ten_frames_a_second_too(aside, told):
    """Three men one after the other were one person: a quarter of a second had too few frames to show where he went."""
    points = np.stack([going_on(frame) for frame in range(40)])
    points[20:] += (aside * np.linalg.norm(np.ptp(points[0], axis=0)), 0)
    assert [row for row, _ in exchanges(np.arange(40) / 10, points)] == [20] * told


def test_who_is_seen_with_more_of_the_body_is_nobody_else():
    """A woman to the hips turned, and more joints of hers were seen: she went on as another person."""
    points = np.stack([going_on(frame) for frame in range(40)])
    size = np.linalg.norm(np.ptp(points[0], axis=0))
    points[:, 13:] += (0, size)
    points[20:, :13] = points[20:, 12::-1]
    points[:20, 13:] = np.nan
    assert not exchanges(np.arange(40) / 30, points)
