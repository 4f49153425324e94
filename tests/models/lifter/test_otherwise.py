"""Doubts about keypoints whose joints may be exchanged, or whose image was stretched, by the built-in lifter."""

from itertools import chain, repeat

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lifter.builtin import lifted
from pcnet3d.models.lifter.otherwise import otherwise_better
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.lifted import ToLift
from pcnet3d.pipeline.core.pose import MadeBy, PoseSequence

WALK = walker(seconds=6.0)
CAMERA = side_camera(WALK)
SIZE = (CAMERA.width, CAMERA.height)
PIXELS = CAMERA.project(WALK.world) + np.random.default_rng(0).normal(0, 1.5, (len(WALK), 17, 2))


def keypoints(pixels=PIXELS, fps=30.0, score=0.9):
    rows = np.arange(len(pixels))
    return PoseSequence(pixels, H36M17, IMAGE, np.full(pixels.shape[:2], score), rows / fps, rows)


@pytest.mark.parametrize("parts", [(), ("",), ("hip",), ("ankle",), ("hip", "knee", "ankle")])
def test_exchanged_joints_are_told(parts):
    pixels = PIXELS.copy()
    for name in H36M17.joints:
        if name.startswith(("l_", "r_")) and any(part in name for part in parts):
            pixels[:, H36M17.index(name)] = PIXELS[:, H36M17.mirror[H36M17.index(name)]]
    asked = ToLift(keypoints(pixels), SIZE)
    said = [each.code for each in otherwise_better(asked, lifted(asked).poses)]
    assert said == (["left-and-right"] if parts else [])


def test_an_image_made_wider_is_told():
    width, height = SIZE
    asked = ToLift(keypoints(PIXELS * [16 / 9, 1]), (round(16 / 9 * width), height))
    assert [each.code for each in otherwise_better(asked, lifted(asked).poses)] == ["image-stretched"]


def test_nothing_is_said_of_the_sides_of_a_moment():
    asked = ToLift(keypoints(PIXELS[:20]), SIZE)
    assert not otherwise_better(asked, lifted(asked).poses)


@pytest.mark.parametrize(
    ("better", "unseen", "score", "told"),
    [
        ((-0.061, -0.028, -0.455), [], 0.9, ["left-and-right"]),
        # A man who leans aside.
        ((0.061, 0.028, -0.455), [], 0.9, []),
        ((0.064, -0.222, -0.06), [], 0.9, ["left-and-right"]),
        # A woman to the hips, facing us.
        ((0.064, -0.222, -0.06), ["l_knee", "r_knee", "l_ankle", "r_ankle"], 0.9, []),
        # A small man in a street.
        ((0.064, -0.222, -0.06), [], 0.45, []),
    ],
)
def test_neither_one_sign_alone_nor_a_trunk_exchanges_sides(monkeypatch, better, unseen, score, told):
    misfits = chain([np.ones(3), np.exp(better)], repeat(np.ones(3)))
    monkeypatch.setattr("pcnet3d.models.lifter.otherwise._misfits", lambda *_: next(misfits))
    pixels = PIXELS.copy()
    pixels[:, H36M17.indices(unseen)] = np.nan
    seen = keypoints(pixels, score=score)
    asked = ToLift(seen.with_(made_by=MadeBy("estimated", "movenet@0")), SIZE)
    assert [each.code for each in otherwise_better(asked, lifted(asked).poses)] == told
