"""Errors of another lifter's angles by how far they are from the built-in lifter's on the same keypoints."""

import numpy as np
import pytest

from golden.lifts import lift
from pcnet3d.examples.walker.camera import R_camera_from_body, camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.disagreement import by_disagreement
from pcnet3d.models.angle_error.take_angles import TakeJoints, take_angles
from pcnet3d.pipeline import H36M17, PoseSequence
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.signals.angles import ANGLES, FINE, UNTRUSTED
from pcnet3d.pipeline.signals.filters import CUTOFF_HZ

KNEE = "r_knee_flexion"


class Filmed:
    """The walker, 3 s, as a lifter has it that is right, and its keypoints."""

    def __init__(self) -> None:
        walk = walker(seconds=3)
        self.camera = side_camera(walk)
        self.poses = camera_poses(walk, self.camera)
        self.keypoints = PoseSequence(
            self.camera.project(walk.world), H36M17, IMAGE, np.ones((len(walk), 17)), walk.time_s,
            self.poses.frame_index,
        )  # fmt: skip
        size = self.camera.width, self.camera.height
        self.second = lift(self.keypoints, size, self.camera.focal_px)
        self.R = R_camera_from_body(walk, self.camera)

    def angles(self, joints=None):
        joints = self.poses.joints.astype(float) if joints is None else joints
        return take_angles(TakeJoints(joints, joints, self.R))

    def judged(self, angles=None, second=None, poses=None):
        return by_disagreement(
            poses or self.poses,
            angles or self.angles(),
            second or self.second,
            self.camera.up,
            np.full(len(self.poses), 2.0),
            CUTOFF_HZ,
        )


@pytest.fixture(scope="module")
def filmed():
    return Filmed()


@pytest.fixture(scope="module")
def right(filmed):
    return filmed.judged()


def test_every_angle_has_an_error_and_no_noise_that_rates_could_be_smoothed_by(filmed, right):
    for name in ANGLES:
        fine = right[name].reason == FINE
        assert fine.mean() > 0.9, name
        np.testing.assert_array_equal(np.isfinite(right[name].sd_deg), fine, name)
        assert (right[name].sd_deg[fine] > 0.5).all(), name
        assert np.isnan(right[name].noise_deg).all(), name
        np.testing.assert_array_equal(right[name].value_deg[fine], filmed.angles()[name].value_deg[fine])


def test_the_error_grows_with_the_disagreement_where_it_is(filmed, right):
    """One second is averaged over, so the error of a half second reaches half a second on either side."""
    angles = filmed.angles()
    off = np.where((filmed.poses.times > 1.25) & (filmed.poses.times < 1.75), 30.0, 0.0)
    knee = angles[KNEE]
    angles[KNEE] = type(knee)(knee.value_deg + off, knee.sd_deg, knee.reason, knee.noise_deg)
    wrong = filmed.judged(angles)
    more = wrong[KNEE].sd_deg - right[KNEE].sd_deg
    assert np.nanmax(more[off > 0]) > 10
    far = np.abs(filmed.poses.times - 1.5) > 0.8
    np.testing.assert_allclose(more[far], 0, atol=1e-9)
    np.testing.assert_array_equal(wrong["l_knee_flexion"].sd_deg, right["l_knee_flexion"].sd_deg)


def test_an_angle_that_is_quite_another_is_left_out(filmed):
    angles = filmed.angles()
    knee = angles[KNEE]
    angles[KNEE] = type(knee)(knee.value_deg + 60.0, knee.sd_deg, knee.reason, knee.noise_deg)
    wrong = filmed.judged(angles)[KNEE]
    assert (wrong.reason == UNTRUSTED).all()
    assert np.isnan([wrong.value_deg, wrong.sd_deg]).all()


def test_an_error_ends_at_a_clip_boundary(filmed, right):
    angles = filmed.angles()
    knee, row = angles[KNEE], 45
    off = np.where(np.arange(len(filmed.poses)) >= row, 25.0, 0.0)
    angles[KNEE] = type(knee)(knee.value_deg + off, knee.sd_deg, knee.reason, knee.noise_deg)
    wrong = filmed.judged(angles, poses=filmed.poses.with_(seams=(row,)))[KNEE]
    apart = filmed.judged(poses=filmed.poses.with_(seams=(row,)))[KNEE]
    np.testing.assert_allclose(wrong.sd_deg[:row], apart.sd_deg[:row])
    assert np.nanmin((wrong.sd_deg - apart.sd_deg)[row:]) > 4


def test_frames_without_a_second_lift_have_no_error_and_with_less_than_half_nothing_has(filmed):
    some = filmed.judged(second=filmed.second.rows(0, 60))
    assert np.isnan(some[KNEE].sd_deg[60:]).all()
    np.testing.assert_array_equal(some[KNEE].value_deg[60:], filmed.angles()[KNEE].value_deg[60:])
    assert np.isfinite(some[KNEE].sd_deg[:60]).mean() > 0.9
    assert filmed.judged(second=filmed.second.rows(0, 40)) is None
    other = filmed.second.with_(frame_index=filmed.second.frame_index + 1000)
    assert filmed.judged(second=other) is None
