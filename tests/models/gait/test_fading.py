"""Steps beside a walk that only the knees show."""

from dataclasses import replace

import numpy as np
import pytest

from golden.walks import GEOMETRIC, measured, seen_from
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.motion import motion_of
from pcnet3d.models.gait.gait import Gait, Step, along_sight, faded_steps, gait_of, swings_of, walks_of
from pcnet3d.pipeline.core.frames import CAMERA, Z_UP

TIMES = np.arange(0, 6, 1 / 30)
LANDS = np.arange(0.8, 5.4, 0.5)  # left and right in turn; each knee swings 0.2 s before its foot lands
KNEES = {
    side: 10 + 50 * sum(np.exp(-(((TIMES - at_s + 0.2) / 0.08) ** 2)) for at_s in LANDS[first::2])
    for first, side in enumerate("lr")
}
STEPS = [Step("rl"[i % 2], at_s, at_s + 0.5) for i, at_s in enumerate(LANDS[:-1])]
EVERYWHERE = np.ones(len(TIMES), dtype=bool)


def faded(seen: slice, knees=KNEES, hidden=EVERYWHERE):
    swings = {side: swings_of(x, TIMES) for side, x in knees.items()}
    return faded_steps(STEPS[seen], knees, swings, TIMES, hidden)


@pytest.mark.parametrize("seen", [slice(3, 6), slice(0, 3), slice(6, 9)])
def test_the_steps_before_and_behind_a_walk_keep_its_rhythm(seen):
    """A man walked towards the camera for 4.8 s in 7 even steps: "walked 3 steps in 1.8 s"."""
    before, behind = faded(seen)
    for found, true in ((before, STEPS[: seen.start]), (behind, STEPS[seen.stop :])):
        assert [step.side for step in found] == [step.side for step in true]
        times = [[at_s for step in steps for at_s in (step.start_s, step.stop_s)] for steps in (found, true)]
        np.testing.assert_allclose(*times, atol=0.05)


def test_where_steps_can_be_seen_the_knees_tell_none():
    assert faded(slice(3, 6), hidden=TIMES < 0) == ([], [])
    before, behind = faded(slice(3, 6), hidden=TIMES > 3)
    assert (before, len(behind)) == ([], 3)


@pytest.mark.parametrize("stops_s", [3.75, 4.25])
def test_a_walk_ends_where_the_knees_rest_or_bend_together(stops_s):
    rests = {side: np.where(stops_s < TIMES, 10, x) for side, x in KNEES.items()}
    crouches = {side: np.where(stops_s < TIMES, KNEES["l"] + KNEES["r"], x) for side, x in KNEES.items()}
    for knees in (rests, crouches):
        _, behind = faded(slice(2, 5), knees)
        assert all(step.stop_s < stops_s + 0.3 for step in behind)


@pytest.mark.parametrize(("turn_deg", "hidden"), [(0, True), (25, True), (60, False), (180, True)])
def test_who_comes_towards_the_camera_or_goes_away_walks_along_its_sight(turn_deg, hidden):
    a, ahead = np.radians(turn_deg), CAMERA.basis[2]
    towards = -ahead * np.cos(a) + CAMERA.basis[0] * np.sin(a)
    R = np.eye(3)[None].copy()
    R[0, :, 0] = -towards
    assert along_sight(R, CAMERA).tolist() == [hidden]
    assert along_sight(R, Z_UP).tolist() == [False]


def test_steps_that_are_depth_are_counted_and_are_in_no_mean():
    """Of a walk towards the camera only the middle was found."""
    motion = motion_of(measured(seen_from(walker(seconds=12, turn_deg=0), 0.0), GEOMETRIC[:3]))
    gait = gait_of(motion)
    (whole,) = walks_of(motion, gait)
    (part,) = walks_of(motion, replace(gait, walks=[list(whole.steps[2:5])]))
    assert part.every.index(part.steps[0]) >= 2
    assert part.every[-1] != part.steps[-1]
    assert abs(len(part.every) - len(whole.every)) <= 1
    assert walks_of(motion, Gait(gait.feet, [])) == []
