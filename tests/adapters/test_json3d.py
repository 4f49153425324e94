"""3D joints in JSON of whoever wrote it: EasyMocap, Azure Kinect, ZED."""

import json

import numpy as np
import pytest

from golden.bodies import limbs_of, standing, turning
from golden.estimators import azure_kinect, easymocap3d
from pcnet3d.adapters import read
from refusals import refused

FRAMES = 30


def test_a_person_in_a_world_and_a_joint_that_was_not_found(tmp_path):
    world = standing(FRAMES)
    poses = read(easymocap3d(tmp_path, world))
    wrist = poses.joint("l_wrist")
    assert np.flatnonzero(np.isnan(wrist).any(axis=1)).tolist() == [7]
    rows = np.arange(FRAMES) != 7
    np.testing.assert_allclose(limbs_of(poses.joints)[rows], limbs_of(world)[rows], atol=2e-5)


def test_axes_and_unit_that_are_told_and_numbers_of_joints_that_nobody_has(tmp_path):
    path = azure_kinect(tmp_path, [turning(FRAMES)])
    assert read(path, unit="cm").joints[0, 5, 1] == pytest.approx(10 * read(path).joints[0, 5, 1])
    content = json.loads(path.read_text(encoding="utf-8"))
    for frame in content["frames"]:
        frame["bodies"][0]["joint_positions"].pop()
    path.write_text(json.dumps(content), encoding="utf-8")
    with refused("wrong-content"):
        read(path, "json3d")
