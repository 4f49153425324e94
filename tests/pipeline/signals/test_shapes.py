import warnings

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.frames import CAMERA, IMAGE
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.signals.shapes import keypoints_movement, keypoints_unlike, rows_lost, shape_findings


@pytest.fixture(scope="module")
def joints():
    """Of an estimator: the walker with some jitter."""
    walk = walker(seconds=8.0)
    return walk.world - walk.root[:, None] + np.random.default_rng(0).normal(0, 0.006, walk.world.shape)


def poses(joints):
    rows = np.arange(len(joints))
    return PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis"), time_s=rows / 30, frame_index=rows)


def codes(joints):
    return {each.code for each in (*shape_findings(poses(joints)), *rows_lost(poses(joints)))}


def test_a_walk_has_none_of_these(joints):
    assert not codes(joints)


def test_a_joint_may_be_missing_in_every_frame(joints):
    for joint in ("r_wrist", "l_ankle", "head"):
        without = joints.copy()
        without[:, H36M17.index(joint)] = np.nan
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert not codes(without)


def test_a_copied_leg_is_told(joints):
    copied = joints.copy()
    hips = H36M17.index("r_hip"), H36M17.index("l_hip")
    for part in ("knee", "ankle"):
        left = joints[:, H36M17.index(f"l_{part}")] - joints[:, hips[1]]
        copied[:, H36M17.index(f"r_{part}")] = joints[:, hips[0]] + left
    assert codes(copied) == {"limbs-copied"}


def test_a_loop_is_told(joints):
    assert "repeats-itself" in codes(np.tile(joints[:60], (3, 1, 1)))


def test_noise_about_one_pose_is_told(joints):
    assert "only-noise" in codes(joints[:1] + np.random.default_rng(1).normal(0, 0.003, joints.shape))


def test_smoothed_poses_are_told(joints):
    from scipy.ndimage import uniform_filter1d

    assert "no-quick-movement" in codes(uniform_filter1d(joints, 15, axis=0))


def test_movement_that_was_made_smaller_is_told(joints):
    usual = joints.mean(axis=0)
    for share in (0.3, 0.5, 0.8):
        (said,) = shape_findings(poses(usual + share * (joints - usual)))
        assert said.code == "movement-shrunk"
        assert said.values["times"] == pytest.approx(1 / share, rel=0.05)
    for share in (0.0, 1.0, 1.5):
        assert "movement-shrunk" not in codes(usual + share * (joints - usual))


def test_rows_that_are_lost_regularly_or_at_once_are_told(joints):
    walk = walker(seconds=8.0)
    quiet = (walk.world - walk.root[:, None])[:120]
    (said,) = rows_lost(poses(np.delete(quiet, np.s_[4::5], axis=0)))
    assert "24" in said.values["how"]
    (said,) = rows_lost(poses(np.delete(walk.world[:120], slice(50, 55), axis=0)))
    assert "row 50" in said.values["how"]
    assert rows_lost(poses(np.repeat(quiet, 4, axis=0))) == []  # repeated, of a video that was slowed


@pytest.fixture(scope="module")
def keypoints():
    """The walker from the side, by a detector with a pixel and a half of noise."""
    walk = walker(seconds=8.0)
    pixels = side_camera(walk).project(walk.world)
    return pixels + np.random.default_rng(0).normal(0, 1.5, pixels.shape)


def seen(pixels):
    rows = np.arange(len(pixels))
    return PoseSequence(pixels, H36M17, IMAGE, np.full(pixels.shape[:2], 0.9), rows / 30, rows)


def test_keypoints_that_were_smoothed_or_shuffled_are_told(keypoints):
    from scipy.ndimage import uniform_filter1d

    assert not keypoints_movement(seen(keypoints))
    (said,) = keypoints_movement(seen(uniform_filter1d(keypoints, 15, axis=0)))
    assert said.code == "keypoints-smooth"
    (said,) = keypoints_movement(seen(np.random.default_rng(1).permutation(keypoints)))
    assert said.code == "only-noise"
    unseen = seen(np.full_like(keypoints, np.nan))
    assert not keypoints_movement(unseen)


def filmed_walk():
    """Joints about the pelvis, pixels, size of the image and the camera."""
    walk = walker(seconds=4.0)
    camera = side_camera(walk)
    inside = camera.points(walk.world)
    return inside - inside[:, :1], camera.project(walk.world), (camera.width, camera.height), camera


def halved(joints):
    return joints.mean(axis=0) + 0.5 * (joints - joints.mean(axis=0))


def test_poses_that_move_half_as_far_as_their_keypoints_are_told():
    whole, pixels, size, camera = filmed_walk()
    points = seen(pixels)
    assert not keypoints_unlike(poses(whole), points, size, camera.focal_px)
    less = poses(halved(whole))
    (said,) = keypoints_unlike(less, points, size, camera.focal_px)
    assert said.code == "keypoints-not-of-poses"
    assert "times as far" in said.text


def test_a_foot_outside_the_image_all_the_time_is_no_fault():
    whole, pixels, size, camera = filmed_walk()
    pixels[:, H36M17.index("l_ankle")] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        (said,) = keypoints_unlike(poses(halved(whole)), seen(pixels), size, camera.focal_px)
    assert said.code == "keypoints-not-of-poses"
