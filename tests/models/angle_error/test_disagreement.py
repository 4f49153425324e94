"""Errors of another lifter's angles by how far they are from the built-in lifter's on the same keypoints; and takes
that are told to be far off."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from golden.jumps import STATURE_M, standing
from golden.lifts import lift
from pcnet3d.examples.walker.camera import R_camera_from_body, camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.disagreement import FAR_OFF_MM, by_disagreement, far_off
from pcnet3d.models.angle_error.take_angles import TakeJoints, take_angles
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.anthropometry import implied_stature
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

    def off(self, deg):
        """The angles with a knee that is so far off."""
        angles = self.angles()
        return angles | {KNEE: replace(angles[KNEE], value_deg=angles[KNEE].value_deg + deg)}

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
    off = np.where((filmed.poses.times > 1.25) & (filmed.poses.times < 1.75), 30.0, 0.0)
    wrong = filmed.judged(filmed.off(off))
    more = wrong[KNEE].sd_deg - right[KNEE].sd_deg
    assert np.nanmax(more[off > 0]) > 10
    far = np.abs(filmed.poses.times - 1.5) > 0.8
    np.testing.assert_allclose(more[far], 0, atol=1e-9)
    np.testing.assert_array_equal(wrong["l_knee_flexion"].sd_deg, right["l_knee_flexion"].sd_deg)


def test_an_angle_that_is_quite_another_is_left_out(filmed):
    wrong = filmed.judged(filmed.off(60.0))[KNEE]
    assert (wrong.reason == UNTRUSTED).all()
    assert np.isnan([wrong.value_deg, wrong.sd_deg]).all()


def test_an_error_ends_at_a_clip_boundary(filmed, right):
    row = 45
    off, poses = np.where(np.arange(len(filmed.poses)) >= row, 25.0, 0.0), filmed.poses.with_(seams=(row,))
    wrong, apart = (filmed.judged(angles, poses=poses)[KNEE] for angles in (filmed.off(off), None))
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


FRAMES = 20
UPRIGHT = SimpleNamespace(R_source_from_body=np.repeat(np.eye(3)[None], FRAMES, axis=0))


def lifted(error_m: float | None, off_m: float = 0.0, tilted_deg: float = 0.0) -> PoseSequence:
    """A standing man, each joint off_m off, whose lifter says that it is off by error_m along each axis."""
    rng = np.random.default_rng(1)
    way = rng.normal(size=(1, 17, 3))
    joints = standing() + off_m * way / np.linalg.norm(way, axis=-1, keepdims=True)
    c, s = np.cos(np.radians(tilted_deg)), np.sin(np.radians(tilted_deg))
    joints = np.repeat(joints @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T, FRAMES, axis=0)
    stated = (
        None if error_m is None else np.tile(error_m**2 * np.eye(3, dtype=np.float32), (FRAMES, 17, 1, 1))
    )
    return PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis", unit="m"), covariance=stated)


@pytest.mark.parametrize(("error_m", "far"), [(0.025, False), (0.08, True), (None, False)])
def test_a_lifter_that_is_unsure_of_a_take_is_believed(error_m, far):
    """Parkour that was off by 111 mm was good, and so was a lunge that was off by 146."""
    said = far_off(lifted(error_m), UPRIGHT)
    assert (said is not None) == far
    assert said is None or said.code == "poses-far-off"
    assert said is None or said.values["mm"] == pytest.approx(1.25 * 80, rel=0.05)


def test_who_lies_is_off_by_more():
    """The axes of a body that lies: its legs are no lower than the pelvis."""
    lies = SimpleNamespace(
        R_source_from_body=np.repeat(np.array([[[0, 0, -1], [0, 1, 0], [1, 0, 0]]]), FRAMES, axis=0)
    )
    assert far_off(lifted(0.05), UPRIGHT) is None
    assert far_off(lifted(0.05), lies) is not None


@pytest.mark.parametrize(("off_m", "far"), [(0.03, False), (0.12, True)])
def test_another_lifters_poses_are_held_against_the_built_in_ones(off_m, far):
    """That the body is turned or of another size does not count."""
    second = lifted(0.02)
    other = lifted(None, off_m, tilted_deg=20)
    assert (far_off(other, UPRIGHT, second) is not None) == far
    smaller = other.with_(joints=0.5 * other.joints, frame=other.frame.with_(unit="arbitrary"))
    assert (far_off(smaller, UPRIGHT, second) is not None) == far
    assert far_off(other.rows(0, 5), UPRIGHT, second) is None  # too little to tell
    assert implied_stature(second.joints) == pytest.approx(STATURE_M, abs=0.15)
    assert FAR_OFF_MM < 100
