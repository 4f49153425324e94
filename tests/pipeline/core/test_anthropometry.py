"""Lengths of a body, and the floor under it, of walkers whose sizes are known."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.anthropometry import floor_height, implied_stature
from pcnet3d.pipeline.core.layouts import body_of
from pcnet3d.pipeline.core.pose import RootPath

POSES = walker(seconds=8).poses


def test_the_floor_of_a_walker_who_squats_and_jumps_is_the_floor():
    assert implied_stature(POSES.joints) == pytest.approx(1.75, abs=0.1)
    level = POSES.with_(joints=POSES.joints - POSES.joints[:, :1], path=RootPath(POSES.joints[:, 0]))
    assert floor_height(level) == pytest.approx(0, abs=0.02)
    raised = level.with_(path=RootPath(level.root + np.array([0, 0, 0.7])))
    assert floor_height(raised) == pytest.approx(floor_height(level) + 0.7)


def test_the_floor_is_told_by_the_feet_that_are_seen():
    joints = POSES.joints - POSES.joints[:, :1]
    level = POSES.with_(joints=joints, path=RootPath(POSES.joints[:, 0]))
    whole = floor_height(level)
    ankles = [POSES.layout.index(f"{side}_ankle") for side in "rl"]
    hidden = joints.copy()
    hidden[:50, ankles[0]] = hidden[20:30, ankles[1]] = np.nan
    assert floor_height(level.with_(joints=hidden)) == pytest.approx(whole, abs=0.02)
    hidden[:, ankles] = np.nan
    assert np.isnan(floor_height(level.with_(joints=hidden)))
    heels = joints[:, ankles] - [0, 0, 0.5]
    shod = level.with_(
        joints=np.concatenate([hidden, heels], axis=1), layout=body_of(["r_heel", "l_heel"]), confidence=None
    )
    assert floor_height(shod) < whole - 0.3
