"""Walks in styles that nobody walked: what was asked for is there, and feet stay where they stand."""

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.gait.contact import SIDES
from pcnet3d.models.lab.mocap.restyle import (
    NAMED,
    Style,
    draw_named,
    draw_style,
    on_floor,
    restyled,
    restyled_walks,
    walked_pieces,
)
from pcnet3d.pipeline.core.layouts import H36M17

LONG = Style(stance=0.75, tempo=1.4, even=1.0, step=0.5, lift=0.3)


@pytest.fixture(scope="module")
def piece():
    (found, *_) = walked_pieces(walked("01_walk", seconds=8))
    return found


def path(clip, name):
    return clip.joints[:, H36M17.index(name)].astype(np.float64)


def bone(clip, a, b):
    return np.linalg.norm(path(clip, a) - path(clip, b), axis=-1)


def slides(clip, spells):
    """By how much an ankle moves over the floor in the middle of each stance."""
    time_s = np.arange(len(clip)) / clip.fps
    rows = [
        (side, (time_s >= start + 0.2 * (stop - start)) & (time_s <= start + 0.6 * (stop - start)))
        for side in SIDES
        for start, stop in spells[side]
        if np.isfinite(start + stop)
    ]
    return [np.linalg.norm(np.ptp(path(clip, f"{side}_ankle")[row, :2], axis=0)) for side, row in rows]


def test_a_walk_in_its_own_style_is_the_walk(piece):
    clip, spells = piece
    same, on = restyled(clip, spells, Style())
    np.testing.assert_allclose(same.joints, clip.joints, atol=1e-4)
    for side in SIDES:
        np.testing.assert_allclose(on[side], spells[side], atol=1e-9)


@pytest.mark.parametrize("stance", [0.55, 0.65, 0.75, 0.8])
def test_stance_takes_as_much_of_the_time_as_is_asked_for(piece, stance):
    clip, spells = piece
    made, on = restyled(clip, spells, Style(stance=stance, tempo=1.2))
    time_s = np.linspace(0, 1.2 * (len(clip) - 1) / clip.fps, 20_001)
    assert np.mean([on_floor(on[side], time_s) for side in SIDES]) == pytest.approx(stance, abs=1e-3)
    assert len(made) == pytest.approx(1.2 * len(clip), abs=2)


@pytest.mark.parametrize("style", [LONG, Style(stance=0.55), Style(uneven=0.3, even=0.5)])
def test_feet_that_stand_slide_no_more_than_before_and_bones_keep_their_lengths(piece, style):
    clip, spells = piece
    made, on = restyled(clip, spells, style)
    assert max(slides(made, on)) <= max(slides(clip, spells)) + 0.002
    for side in SIDES:
        for a, b in (("hip", "knee"), ("knee", "ankle")):
            was = np.median(bone(clip, f"{side}_{a}", f"{side}_{b}"))
            np.testing.assert_allclose(bone(made, f"{side}_{a}", f"{side}_{b}"), was, atol=0.006)


def test_a_limp_is_of_one_side(piece):
    """The side that bears the body alone for less time has the shorter stance."""
    clip, spells = piece
    _, on = restyled(clip, spells, Style(uneven=-0.3))
    lasts = {side: np.nanmean(np.diff(on[side], axis=1)) for side in SIDES}
    was = {side: np.nanmean(np.diff(spells[side], axis=1)) for side in SIDES}
    assert lasts["r"] < was["r"] - 0.05
    assert lasts["l"] > was["l"] + 0.05


def test_steps_shorten_and_feet_lift_less(piece):
    clip, spells = piece
    made, _ = restyled(clip, spells, LONG)
    far = {one: np.linalg.norm(np.diff(path(one, "pelvis")[[0, -1], :2], axis=0)) for one in (clip, made)}
    assert far[made] <= 0.51 * far[clip]
    assert np.ptp(path(made, "r_ankle")[:, 2]) == pytest.approx(
        0.3 * np.ptp(path(clip, "r_ankle")[:, 2]), rel=0.1
    )


def test_drawn_styles_reach_from_hurried_to_shuffling():
    rng = np.random.default_rng(0)
    drawn = [draw_style(rng) for _ in range(300)]
    stance = np.array([style.stance for style in drawn])
    assert stance.min() < 0.52
    assert stance.max() > 0.78
    assert 0.35 < np.mean([style.uneven == 0 for style in drawn]) < 0.65
    slow = np.mean([style.tempo for style in drawn if style.stance > 0.7])
    assert slow > 1.1 * np.mean([style.tempo for style in drawn if style.stance < 0.6])


@pytest.mark.parametrize("name", NAMED)
def test_a_style_by_name_lies_where_it_says(name):
    rng = np.random.default_rng(0)
    drawn = [draw_named(NAMED[name], rng) for _ in range(50)]
    for value, (low, high) in NAMED[name].items():
        assert all(low <= getattr(style, value) <= high for style in drawn)
    clip = walked("01_walk", seconds=8)
    ((made, on),) = restyled_walks([clip], 1, 0, name)
    low, high = NAMED[name].get("stance", (0.6, 0.7))
    time_s = np.arange(len(made)) / clip.fps
    share = np.mean([on_floor(on[side], time_s) for side in SIDES])
    assert low - 0.02 <= share <= high + 0.02
