"""Where a video goes on with another scene."""

import numpy as np
import pytest

from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.scene_cuts import Glance
from pcnet3d.models.detector.video import detect


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
