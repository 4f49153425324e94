"""Whether the camera moves: synthetic pictures that are shifted and scaled by known amounts, and people before them."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from pcnet3d.models.gravity.view import Glimpse, Shift, background_of, shift, stands

_NOBODY = np.zeros((0, 4))
_SIDE = 640


def picture(right: float = 0.0, down: float = 0.0, zoom: float = 1.0, seed: int = 0) -> np.ndarray:
    noise = np.random.default_rng(seed).integers(0, 255, (440, 740)).astype(np.uint8)
    wide = cv2.GaussianBlur(noise, (0, 0), 3)
    wide = cv2.normalize(wide, None, 0, 255, cv2.NORM_MINMAX)
    M = np.array([[zoom, 0, right - 50 - 370 * (zoom - 1)], [0, zoom, down - 40 - 220 * (zoom - 1)]])
    return cv2.cvtColor(cv2.warpAffine(wide, M, (_SIDE, 360)), cv2.COLOR_GRAY2RGB)


@pytest.mark.parametrize(("right", "down"), [(0.0, 0.0), (3.0, 0.0), (-8.0, 5.0), (20.0, -12.0)])
def test_a_shifted_picture_moves_by_its_shift(right, down):
    moved = shift(picture(), picture(right, down), [_NOBODY, _NOBODY])
    assert moved is not None
    assert [moved.right, moved.down] == pytest.approx([right / _SIDE, down / _SIDE], abs=0.3 / _SIDE)
    assert (moved.still > 0.9) == (right == down == 0)


def test_a_picture_that_grows_has_its_zoom():
    moved = shift(picture(), picture(zoom=1.04), [_NOBODY, _NOBODY])
    assert moved is not None
    assert moved.zoom == pytest.approx(np.log(1.04), abs=0.005)


def test_a_person_who_moves_is_no_background():
    before, after = picture(), picture()
    box = np.array([[150.0, 0.0, 520.0, 360.0]])
    after[:, 150:520] = picture(12.0)[:, 150:520]
    without = shift(before, after, [box, box])
    assert without is not None
    assert without.still > 0.9


def test_a_plain_wall_and_another_place_tell_nothing():
    wall = np.full((360, _SIDE, 3), 128, np.uint8)
    assert shift(wall, wall, [_NOBODY, _NOBODY]) is None
    assert shift(picture(), picture(seed=1), [_NOBODY, _NOBODY]) is None
    assert not stands({0: wall, 9: wall}, {0: _NOBODY, 9: _NOBODY})


def test_a_tripod_stands_and_a_shifted_one_does_not():
    boxes = {0: _NOBODY, 30: _NOBODY, 60: _NOBODY}
    assert stands({0: picture(), 30: picture(), 60: picture()}, boxes)
    assert not stands({0: picture(), 30: picture(), 60: picture(4.0)}, boxes)


def test_a_crowd_does_not_move_as_one_picture():
    crowd, rng = picture(), np.random.default_rng(2)
    for left in range(0, _SIDE, 80):
        right, down = rng.uniform(-15, 15, 2)
        crowd[:, left : left + 80] = picture(right, down)[:, left : left + 80]
    of_crowd, of_pan = (shift(picture(), seen, [_NOBODY, _NOBODY]) for seen in (crowd, picture(15.0)))
    assert of_crowd is not None
    assert of_pan is not None
    assert of_crowd.together < 0.4 < 0.9 < of_pan.together


def glimpses(right, zoom=0.0, together=1.0, spread=0.7):
    """Ten glimpses over ten seconds; right: (10,), in longer sides of the image a second."""
    return [
        Glimpse(
            float(i),
            0.1,
            Shift(0.1 * way, 0.0, float(abs(way) < 1e-4), together, spread, 0.1 * grows),
        )
        for i, (way, grows) in enumerate(np.broadcast(right, zoom * np.ones(10)))
    ]


@pytest.mark.parametrize(
    ("right", "zoom", "kind", "moves"),
    [
        (0.0, 0.0, "still", False),
        (-0.1, 0.0, "panning", True),
        (0.001 * np.array([1, -1] * 5), 0.0, "hand-held", False),
        (0.03 * np.array([1, -1] * 5), 0.0, "hand-held", False),  # nearly two degrees, to and fro
        (0.0009, 0.0, "hand-held", False),  # half a degree in all
        (0.2 * np.array([1, 1, 1, -1, -1, -1, -1, 1, 1, 1]), 0.0, "panning", True),
        (0.01, 0.3, "zooming", True),
        (0.0009, 0.02, "zooming", True),  # who films from a car that goes on slowly
        (0.0009, 0.04 * np.array([1, -1] * 5), "hand-held", False),
    ],
)
def test_how_a_camera_moves(right, zoom, kind, moves):
    found = background_of(glimpses(right, zoom))
    assert found is not None
    assert (found.kind, found.moves) == (kind, moves)
    assert (found.shake > 0) == (kind == "hand-held")


def test_a_camera_that_shakes_reaches_no_further_than_it_was_shown_to():
    """A phone shaken by 17 pixels was said to wander by 116: speeds of a tenth of a second, a second apart."""
    rng = np.random.default_rng(3)
    at = 0.01 * rng.uniform(-1, 1, 10)
    shaken = [
        replace(each, onward=Shift(float(after - here), 0.0, 0.0, 1.0, 0.7, 0.0))
        for each, here, after in zip(glimpses(0.05 * np.sign(at)), at, [*at[1:], at[-1]], strict=True)
    ]
    measured, by_speeds = background_of(shaken), background_of(glimpses(0.05 * np.sign(at)))
    assert measured is not None
    assert by_speeds is not None
    assert measured.kind == "hand-held"
    assert measured.reach == pytest.approx(np.ptp(at), rel=0.3)
    assert by_speeds.reach > 3 * measured.reach


def test_nothing_is_told_without_a_glimpse_or_of_a_crowd():
    assert background_of([]) is None
    assert background_of(glimpses(0.1, together=0.3)) is None
    assert background_of(glimpses(0.1, spread=0.05)) is None
    assert background_of(glimpses(0.0, spread=0.05)) is not None


def test_corners_of_one_spot_that_moves_are_no_picture():
    before, after = (np.full((360, _SIDE, 3), 128, np.uint8) for _ in range(2))
    before[120:220, 200:340] = picture()[120:220, 200:340]
    after[120:220, 200:340] = picture(6.0)[120:220, 200:340]
    of_spot, of_pan = (shift(before, after, [_NOBODY] * 2), shift(picture(), picture(6.0), [_NOBODY] * 2))
    assert of_spot is not None
    assert of_pan is not None
    assert of_spot.spread < 0.1 < 0.5 < of_pan.spread
