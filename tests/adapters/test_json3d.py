"""3D joints in JSON of whoever wrote it: EasyMocap, Azure Kinect, ZED."""

import json

import numpy as np
import pytest

from golden.bodies import standing, turning
from golden.estimators import azure_kinect, easymocap3d
from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17
from refusals import refused

FRAMES = 30


def test_a_joint_that_was_not_found_is_missing(tmp_path):
    missing = np.isnan(read(easymocap3d(tmp_path, standing(FRAMES))).joints).any(axis=-1)
    assert np.argwhere(missing).tolist() == [[7, H36M17.index("l_wrist")]]


def test_axes_and_unit_that_are_told_and_numbers_of_joints_that_nobody_has(tmp_path):
    path = azure_kinect(tmp_path, [turning(FRAMES)])
    assert read(path, unit="cm").joints[0, 5, 1] == pytest.approx(10 * read(path).joints[0, 5, 1])
    content = json.loads(path.read_text(encoding="utf-8"))
    for frame in content["frames"]:
        frame["bodies"][0]["joint_positions"].pop()
    path.write_text(json.dumps(content), encoding="utf-8")
    with refused("wrong-content"):
        read(path, "json3d")
