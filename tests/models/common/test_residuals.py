"""Poses against keypoints, and the one number of a lifter's stated error: known answers on the walker."""

import warnings

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.residuals import LIMBS, residuals, stated_spread
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.camera import Camera

SIZE, FOCAL = (1280, 720), 900.0
LENS = Camera(SIZE, FOCAL, 0.0, "told")


@pytest.fixture
def scene(filmed):
    """The walker's body (PoseSequence) and its exact keypoints."""
    return filmed.poses, filmed.keypoints


def moved(body, joint, by) -> PoseSequence:
    joints = body.joints.copy()
    joints[:, H36M17.index(joint)] += by
    return body.with_(joints=joints)


def test_exact_poses_are_on_their_keypoints(scene):
    found = residuals(*scene, LENS)
    assert np.nanmax(found.whole()) < 0.002
    assert all(np.nanmax(found.limb(limb)) < 0.003 for limb in LIMBS)


def test_a_wrist_that_is_off_is_off_in_its_limb_alone_and_by_as_much(scene):
    body, keypoints = scene
    stature = implied_stature(body.joints)
    found = residuals(moved(body, "r_wrist", [0, 0.1 * stature, 0]), keypoints, LENS)
    assert np.nanmedian(found.limb("r_arm")) == pytest.approx(0.1 / np.sqrt(2), rel=0.1)
    assert np.nanmax(found.limb("l_arm")) < 0.01
    wrist = H36M17.index("r_wrist")
    assert (found.statures[:, wrist, 1] > 0.05).all()  # y down: the joint's image is below its keypoint


def test_residuals_do_not_depend_on_the_unit_of_the_poses(scene):
    body, keypoints = scene
    one = residuals(moved(body, "r_knee", 0.05), keypoints, LENS)
    mm = moved(body, "r_knee", 0.05)
    other = residuals(mm.with_(joints=1000 * mm.joints), keypoints, LENS)
    assert np.allclose(one.statures, other.statures, atol=1e-4, equal_nan=True)


def test_a_joint_without_a_keypoint_has_no_residual(scene):
    body, keypoints = scene
    pixels = keypoints.joints.copy()
    pixels[:, H36M17.index("l_ankle")] = np.nan
    found = residuals(body, keypoints.with_(joints=pixels), LENS)
    assert np.isnan(found.limb("l_leg")).all()
    assert np.isfinite(found.whole()).all()


def test_it_is_the_geometric_mean_of_the_deviations_in_statures():
    joints = walker().world[:10].astype(np.float32)
    covariance = np.zeros((10, 17, 3, 3))
    covariance[:] = np.diag([0.01, 0.01, 0.08]) ** 2
    covariance[:, H36M17.index("pelvis")] = 0
    covariance[3, 5] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, covariance=covariance)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = stated_spread(poses)
    assert found[0] == pytest.approx(0.02 / implied_stature(joints), rel=1e-4)
    assert np.isnan(found[3])
    assert np.isnan(stated_spread(poses.with_(covariance=None))).all()
