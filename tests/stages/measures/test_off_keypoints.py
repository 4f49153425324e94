"""Limbs that are exchanged between poses and keypoints, on the walker with exact keypoints."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import aimed, camera_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, IMAGE, PoseSequence, Take
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.signals.reprojection import residuals_of
from pcnet3d.pipeline.signals.swaps import kinds
from pcnet3d.stages.measures.off_keypoints import exchanged

SIZE, FOCAL = (1280, 720), 900.0
LEGS, ARMS = kinds(H36M17, depth=False)


@pytest.fixture(scope="module")
def filmed():
    walk = walker(seconds=3)
    camera = aimed(walk.root.mean(axis=0), 6, heading_deg=60, pitch_deg=10, roll_deg=3)
    body, points = camera_poses(walk, camera), camera.points(walk.world)
    pixels = FOCAL * points[..., :2] / points[..., 2:] + np.array(SIZE) / 2
    keypoints = PoseSequence(pixels, H36M17, IMAGE, time_s=body.time_s, frame_index=body.frame_index)
    return Take("walk", poses=body, keypoints=keypoints, camera=Camera(SIZE, FOCAL, 0.0, "told"))


def codes(take: Take) -> list[str]:
    return [each.code for each in exchanged(take, residuals_of(take))]


@pytest.mark.parametrize("which", ["poses", "keypoints"])
@pytest.mark.parametrize("way", [LEGS, ARMS], ids=lambda way: way.name)
def test_legs_that_fit_each_others_keypoints_are_said_to_be_exchanged(filmed, which, way):
    """A lift had a walker's legs exchanged, and the page said only that both contradict the keypoints."""
    of = getattr(filmed, which)
    joints = of.joints.copy()
    joints[20:50] = way.applied(joints[20:50])
    assert codes(filmed.with_(**{which: of.with_(joints=joints)})) == ["swapped-to-keypoints"]


def test_legs_that_are_elsewhere_are_not_said_to_be_exchanged(filmed):
    joints = filmed.poses.joints.copy()
    joints[20:50, H36M17.indices(("r_ankle", "l_ankle"))] += [0.4, 0.0, 0.0]
    assert codes(filmed.with_(poses=filmed.poses.with_(joints=joints))) == []
    assert codes(filmed) == []
    assert exchanged(filmed.with_(keypoints=None), None) == []
