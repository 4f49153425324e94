"""Heels and toes of the sources that have them arrive behind the 17 joints, where they are."""

from functools import partial

import numpy as np
import pytest

from golden import estimators, landmarks, worlds
from golden.bodies import feet_in, feet_of, placed, standing, turning
from golden.lifters import openpose3d, rtmw3d
from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.layouts import BODY_25, BODY_25B, FEET, HALPE26

FRAMES = 40
TOES, SMALL = (FEET.indices([f"{side}_{toe}_toe" for side in "rl"]) for toe in ("big", "small"))


def blazepose(folder, bodies):
    feet = feet_of(bodies)
    feet[:, TOES] = (feet[:, TOES] + feet[:, SMALL]) / 2  # the foot index
    feet[:, SMALL] = np.nan
    return read(landmarks.wide(folder, landmarks.landmarks(bodies)), fps=25), feet


def body_25(folder, bodies, layout=BODY_25):
    away = placed(bodies + np.array([0.3, 0.1, 4.0]), layout.joints)
    return read(openpose3d(folder, [[body] for body in away]), fps=25), feet_of(bodies)


def whole_body(folder, bodies):
    path = rtmw3d(folder, [bodies])
    return read(path, fps=25, stature_m=implied_stature(bodies)), feet_of(bodies)


def mhr70(folder, bodies):
    return read(estimators.sam3d_stacked(folder, bodies), fps=25), feet_of(bodies)


@pytest.mark.parametrize("source", [blazepose, body_25, partial(body_25, layout=BODY_25B), whole_body, mhr70])
def test_feet_of_lifters(source, tmp_path):
    bodies = turning(FRAMES)
    poses, feet = source(tmp_path, bodies)
    at_pelvis = feet - bodies[:, H36M17.indices(["l_hip", "r_hip"])].mean(axis=1, keepdims=True)
    pelvis = bodies[:, [H36M17.index("pelvis")]]
    np.testing.assert_allclose(feet_in(poses), feet - pelvis if source is body_25 else at_pelvis, atol=4e-3)


def test_feet_of_markers(tmp_path):
    """Pose2Sim's names of HALPE_26."""
    bodies = standing(FRAMES)
    paired = {f"{side.upper()}{part.title().replace('_', '')}": f"{side}_{part}"
              for side in "rl" for part in ("big_toe", "small_toe", "heel")}  # fmt: skip
    assert set(paired.values()) <= set(HALPE26.joints)
    names = worlds.POSE2SIM | paired
    points = np.concatenate([bodies, feet_of(bodies)], axis=1)
    rows = [(*H36M17.joints, *FEET.joints).index(joint) for joint in names.values()]
    poses = read(worlds.trc(tmp_path / "walk.trc", names, worlds.y_up(points[:, rows])))
    expected = worlds.y_up(feet_of(bodies) - bodies[:, [H36M17.index("pelvis")]])
    np.testing.assert_allclose(feet_in(poses), expected, atol=1e-4)


def test_a_source_without_feet_has_none(tmp_path):
    points = standing(FRAMES)[:, H36M17.indices(list(worlds.POSE2SIM.values()))]
    assert read(worlds.trc(tmp_path / "walk.trc", worlds.POSE2SIM, worlds.y_up(points))).layout == H36M17
