"""Images that repeat the one before: told from somebody who stands still, and left out."""

from dataclasses import replace

import numpy as np
import pytest

from golden.detections import detected, scored
from golden.films import film_of
from pcnet3d.adapters.keypoints import read as read_keypoints
from pcnet3d.adapters.video import read as read_video
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.scene_cuts import Glance, repeated
from pcnet3d.models.detector.video import detect

MOVES, NOT = [40.0] * 6, [1.0] * 10
PADDED = np.arange(1, 51) * 4 // 5  # images shown, of 24 frames a second in 30
STALLED = np.r_[0:20, [19] * 9, 29:40]


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ([40, 42, 38, 5, 41, 40, 43, 39, 4, 42], [3, 8]),
        ([40, 1, 40, 1, 2, 40, 1, 40, 1, 2, 40], [1, 3, 4, 6, 8, 9]),
        ([*MOVES, *NOT, 70, *MOVES], range(6, 16)),  # a stall
        ([*MOVES, *NOT, 40, *MOVES], range(6, 16)),  # an image that is shown on: a freeze of 3 s went unsaid
        ([*MOVES, *[3.0] * 10, 40, *MOVES], []),  # somebody stands before a still camera
        ([*MOVES, 25, 15, 8, 4, *NOT, 4, 8, 15, 25, *MOVES], []),  # and of life
        ([np.nan, *[0] * 30], range(1, 31)),  # a picture
        ([*MOVES, *NOT], range(6, 16)),  # to the end
        ([np.nan, *NOT, *MOVES], range(1, 11)),
        ([np.nan, 6.2, 1.4, *[0.1] * 10, 3.3, *[0] * 10], range(1, 24)),  # a picture, encoded
        ([*MOVES, np.nan, *[0.1] * 10], range(7, 17)),  # behind a cut
        ([*MOVES, *NOT, np.nan, *MOVES], range(6, 16)),  # up to a cut
        ([*[70.0] * 6, *[15.0] * 8, 130, *[45.0] * 6], range(6, 14)),  # a stall, coarsely encoded
        (
            [*[16.0] * 6, 159, *[20.0] * 17, 151, *[25.0] * 20, 151, *[20.0] * 6],
            [],
        ),  # subtitles over what moves
        ([*[4.0] * 6, *NOT, *[4.0] * 6], []),  # somebody small stands
        (NOT * 3, []),
        ([*NOT, 16] * 4, []),  # a sharper key frame now and then
        ([1, 1, 1, 8] * 6, []),
        ([*MOVES, np.nan, 1, *MOVES], []),  # a cut to another scene
        ([np.nan, 1, 1, *MOVES], []),  # nothing moved before
        ([*MOVES, 1, 1], []),  # nor after
        ([40, 40, 12, 40, 40], []),  # slower for once
        ([], []),
    ],
)
def test_what_changes_much_less_than_beside_it_repeats(change, found):
    np.testing.assert_array_equal(repeated(np.array(change, np.float32)), list(found))


def test_change_is_of_what_moves_not_of_light(toys):
    here, moved = toys.scene((50, 50, 80, 150)), toys.scene((54, 50, 84, 150))
    noisy = np.clip(here + np.random.default_rng(0).normal(0, 4, here.shape), 0, 255).astype(np.uint8)
    at = Glance.at(here)
    assert at.change_to(Glance.at(here)) == 0
    assert 4 * at.change_to(Glance.at(noisy)) < at.change_to(Glance.at(moved)) < 255
    assert np.isnan(at.change_to(Glance.at(here[:100])))


@pytest.fixture
def shown(toys, tmp_path):
    """shown(numbers, codec, options): a film of these images of somebody walking, 30 a second."""

    def make(numbers, codec="libx264", **options):
        boxes = toys.walking(max(numbers) + 1)
        stamps = [round(1000 * i / 30) for i in range(len(numbers))]
        images = [toys.scene(boxes[number], size=(360, 240)) for number in numbers]
        return read_video(film_of(tmp_path / "film.mp4", images, stamps, codec, **options))[0]

    return make


@pytest.mark.parametrize(
    ("codec", "options"), [("libx264", {"crf": 20}), ("libx264", {"crf": 32}), ("mpeg4", {"b": 2_000_000})]
)
@pytest.mark.parametrize("numbers", [PADDED, STALLED])
def test_repeats_of_a_compressed_film_are_found(shown, toy, numbers, codec, options):
    found = detect(shown(numbers, codec, **options), load_detector(toy))
    np.testing.assert_array_equal(found.repeated, np.flatnonzero(np.diff(numbers) == 0) + 1)


@pytest.mark.parametrize("begins", [0, 20])
@pytest.mark.parametrize("goes_on", [0, 20])
def test_a_film_that_stands_still_shows_nobody_meanwhile(shown, toy, begins, goes_on):
    """A freeze of three seconds was part of a posture that was held for 5.6 s; a single repeat had a warning."""
    moves = [*range(begins), *[begins] * 20, *range(begins, begins + goes_on)]
    found = detect(shown(moves, g=12), load_detector(toy))
    (person,) = found.people()
    (said,) = found.doubts(person)
    still = range(begins + 1, begins + 20 + (goes_on > 0))
    if begins or goes_on:
        assert (said.code, said.weight) == ("images-frozen", "warning")
        assert not np.isin(person.frame_index, still).any()
    else:
        assert (said.code, said.weight) == ("images-frozen", "suspicious")
        assert len(person) == 20
    np.testing.assert_array_equal(found.repeated, still)


def test_few_are_bridged_and_in_a_stall_is_nobody(shown, toy, toys, tmp_path):
    """The joints of a repeated image, half way from the one before to the next; a third of them was off by 3 pixels."""
    padded, stalled = (detect(shown(numbers), load_detector(toy)) for numbers in (PADDED, STALLED))
    boxes = np.array(toys.walking(50))
    assert len(padded.frame_index) == 50
    for frame in padded.repeated:
        between = (boxes[PADDED[frame - 1]] + boxes[PADDED[frame + 1]]) / 2
        assert np.abs(padded.joints[frame] - toys.joints_of(tuple(between))).max() < 1.5
    np.testing.assert_array_equal(stalled.frame_index, [*range(20), *range(29, 40)])
    for found in (padded, stalled):
        found.save(tmp_path / "keypoints.npz")
        (person,) = read_keypoints(tmp_path / "keypoints.npz")
        (said,) = person.notices
        assert (said.code, said.weight) == ("images-repeated", "warning")
        assert said.values["repeated"] == len(found.repeated)


def test_a_film_of_which_most_repeats_makes_speeds_suspicious(shown, toy):
    found = detect(shown(np.arange(60) // 3), load_detector(toy))
    (said,) = found.doubts(*found.people())
    assert (said.code, said.weight) == ("images-repeated", "suspicious")


def test_images_in_which_nothing_moves_are_not_counted():
    """Every image of a slow dance was there twice, and "45 of 298 only repeat"."""
    found = detected(np.arange(80), scored(np.zeros((80, 17, 2))), np.zeros(80, int))
    change = np.where(np.arange(80) % 2, 1.0, np.where(np.arange(80) < 40, 5.0, 40.0))
    change[0] = np.nan
    told = replace(found, change=change, repeated=repeated(change), frames=80, frames_seen=80)
    (said,) = (each for each in told.doubts(*told.people()) if each.code == "images-repeated")
    assert said.values["repeated"] / said.values["of"] == pytest.approx(0.5, abs=0.05)


def test_only_images_in_which_the_person_is_seen_count(shown, toy):
    """A walker out of the picture after 1.4 s was said to be affected by repeats at the end of the film."""
    found = detect(shown(STALLED), load_detector(toy))
    assert found.repeated.tolist() == list(range(20, 29))

    def repeats(first: int, last: int) -> list[tuple[int, int]]:
        rows = (found.frame_index >= first) & (found.frame_index <= last)
        names = ("frame_index", "time_s", "person", "joints", "confidence", "box")
        seen = replace(found, **{name: getattr(found, name)[rows] for name in names})
        said = (each for each in seen.doubts(*seen.people()) if each.code == "images-repeated")
        return [(each.values["repeated"], each.values["of"]) for each in said]

    assert repeats(0, 39) == [(9, 39)]
    assert repeats(10, 39) == [(9, 29)]
    assert repeats(0, 19) == repeats(29, 39) == repeats(5, 5) == []
