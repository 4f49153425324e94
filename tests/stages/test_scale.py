"""Scale: one factor from the limbs, and honesty where there is none."""

import numpy as np
import pytest

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take, Told
from pcnet3d.pipeline.core.anthropometry import SEGMENTS
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.scale import Scale, scale
from refusals import refused

ARBITRARY = CAMERA.with_(unit="arbitrary")


def adult(stature: float) -> np.ndarray:
    """(17, 3) a straight chain whose limb bones have the table's lengths."""
    joints = np.zeros((17, 3))
    for (start, end), fraction in SEGMENTS.items():
        joints[H36M17.index(end)] = joints[H36M17.index(start)] + [0, fraction * stature, 0]
    return joints


def test_a_body_of_known_stature_gets_its_metres_back():
    truth = np.repeat(adult(1.8)[None], 5, axis=0)
    poses = PoseSequence(truth * 0.37, H36M17, ARBITRARY)
    scaled = scale(poses, 1.8)[0]
    assert scaled.frame.unit == "m"
    np.testing.assert_allclose(scaled.joints, truth, rtol=1e-5)


def test_poses_that_were_turned_upright_before_are_scaled_with_them(facing_camera):
    poses = PoseSequence(np.repeat(facing_camera[None], 5, axis=0), H36M17, ARBITRARY)
    before = Rectify("geometric")(Take("t", poses=poses, told=Told(stature_m=1.8)))
    after = Scale()(before)
    factor = scale(poses, 1.8)[1]
    assert abs(factor - 1) > 0.01
    np.testing.assert_allclose(
        after.rectified.level.joints, factor * before.rectified.level.joints, rtol=1e-5
    )
    assert after.rectified.level.frame.unit == after.rectified.source.unit == "m"


def test_without_a_stature_the_unit_is_kept_and_said():
    take = Take("t", poses=PoseSequence(adult(1.0)[None], H36M17, ARBITRARY))
    kept = Scale()(take)
    assert kept.poses is take.poses
    assert "--stature" in kept.notices[0].text
    assert Scale()(Take("t", poses=take.poses.with_(frame=CAMERA))).notices == ()


def test_a_body_without_limbs_cannot_be_scaled():
    with refused("nothing-usable"):
        scale(PoseSequence(np.full((2, 17, 3), np.nan), H36M17, ARBITRARY), 1.8)


@pytest.mark.parametrize(("kind", "codes"), [("estimated", ["no-scale"]), ("measured", []), ("unknown", [])])
def test_metres_of_an_estimator_are_said_to_be_assumed(kind, codes):
    """A page gave the speed of a walk in metres a second, out of one camera and without a height."""
    poses = PoseSequence(adult(1.7)[None], H36M17, CAMERA, made_by=MadeBy(kind))
    assert [each.code for each in Scale()(Take("t", poses=poses)).notices] == codes
