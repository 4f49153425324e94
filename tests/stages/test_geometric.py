"""GEOMETRIC and LEVEL: exact properties, and a person whose heading is known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pcnet3d.models import load_rectifier
from pcnet3d.models.gravity.levelling import level_frame
from pcnet3d.pipeline import CAMERA, H36M17, Y_UP, Z_UP, PoseSequence, change_frame
from pcnet3d.pipeline.core.frames import GL_CAMERA, PC_CAMERA
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg, rotate, transpose
from pcnet3d.stages.rectify import rectify
from refusals import refused

R_FACING_THE_CAMERA = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]])  # design.md section 4
UPRIGHT = Rotation.identity()
seeds = st.integers(0, 2**32 - 1)


def bodies(seed: int, rows: int = 6) -> np.ndarray:
    joints = np.random.default_rng(seed).normal(size=(rows, 17, 3))
    return joints - joints[:, :1]


@given(seeds)
def test_rotation_of_a_turned_body_is_the_turned_rotation(seed):
    Q = Rotation.random(random_state=seed % 2**31).as_matrix()
    rectifier = load_rectifier("geometric")
    turned, _ = rectifier.rotation(rotate(Q, bodies(seed)))
    np.testing.assert_allclose(turned, Q @ rectifier.rotation(bodies(seed))[0], atol=1e-9)


@given(seeds, st.floats(1e-3, 1e3))
def test_it_is_a_rotation_and_knows_no_scale(seed, scale):
    rectifier = load_rectifier("geometric")
    R, _ = rectifier.rotation(bodies(seed))
    np.testing.assert_allclose(R @ transpose(R), np.broadcast_to(np.eye(3), R.shape), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(R), 1)
    np.testing.assert_allclose(rectifier.rotation(bodies(seed) * scale)[0], R, atol=1e-9)


def headings_to_R(headings_deg, tilt=UPRIGHT) -> np.ndarray:
    """R_source_from_body of an upright person who turns about a vertical that leans by `tilt`."""
    return (tilt * Rotation.from_rotvec(np.outer(np.radians(headings_deg), [0, 0, 1]))).as_matrix()


@given(st.floats(-180, 180), st.floats(0, 60), seeds)
def test_level_has_the_takes_up_and_its_median_heading(heading, tilt_deg, seed):
    tilt = Rotation.from_rotvec(np.radians(tilt_deg) * np.array([0.6, -0.8, 0]))
    wobble = np.random.default_rng(seed).uniform(-20, 20, size=31)
    R = headings_to_R(heading + wobble, tilt)
    R_level, how = level_frame(R, tilt.as_matrix()[:, 2], np.arange(31) / 30)
    assert how == "median"
    assert angle_deg(R_level[:, 2], tilt.as_matrix()[:, 2]) < 1e-6
    assert geodesic_deg(R_level, headings_to_R(heading + np.median(wobble), tilt)[0]) < 1e-5


def test_a_person_who_turns_around_gets_the_heading_of_the_first_second():
    time_s = np.arange(90) / 30
    heading = np.where(time_s <= 1, 40.0, 40 + 180 * (time_s - 1))
    R_level, how = level_frame(headings_to_R(heading), np.array([0.0, 0.0, 1.0]), time_s)
    assert how == "first second"
    assert geodesic_deg(R_level, headings_to_R([40.0])[0]) < 1e-5


def test_ups_that_scatter_are_not_called_level(facing_camera):
    """A body that turns over again and again, about a mean up that is the image's."""
    R = Rotation.from_rotvec(np.radians(50) * np.stack([np.cos(a := np.arange(60.0)), 0 * a, np.sin(a)], -1))
    rectified = rectify(
        PoseSequence(rotate(R.as_matrix(), np.tile(facing_camera, (60, 1, 1))), H36M17, CAMERA), "geometric"
    )
    assert "scatter" in rectified.level_reason


def test_a_person_who_lies_across_the_image_is_not_called_level(facing_camera):
    motion = facing_camera + np.random.default_rng(0).normal(scale=0.01, size=(20, 17, 3))
    lying = rotate(Rotation.from_euler("z", 85, degrees=True).as_matrix(), motion)
    assert rectify(PoseSequence(motion, H36M17, CAMERA), "geometric").level_ok
    for poses in (PoseSequence(lying, H36M17, CAMERA), PoseSequence(motion, H36M17, GL_CAMERA)):
        rectified = rectify(poses, "geometric", check="off")
        assert not rectified.level_ok
        assert "from the image's" in rectified.level_reason


def test_a_source_that_knows_its_gravity_is_levelled_by_it(facing_camera):
    R_world_from_camera = R_FACING_THE_CAMERA.T
    leaning = facing_camera.copy()
    trunk = H36M17.indices(["spine", "thorax", "nose", "head", "l_shoulder", "r_shoulder"])
    lean = Rotation.from_euler("x", 30, degrees=True).as_matrix()
    leaning[trunk] = rotate(lean, leaning[trunk])
    world = PoseSequence(rotate(R_world_from_camera, leaning)[None], H36M17, Z_UP, made_by=MadeBy("measured"))
    rectified = rectify(world, "geometric")
    assert rectified.method == "gravity"
    np.testing.assert_allclose(rectified.R_source_from_body[0, :, 2], [0, 0, 1], atol=1e-12)
    assert rectified.in_world
    assert rectified.camera is None
    assert (rectified.up_bound_deg == 0).all()
    for told in ({"camera": "moving"}, {"gravity": (0.0, 1.0, 0.0)}, {"pitch_deg": 0.0, "roll_deg": 0.0}):
        with refused("option-conflict"):
            rectify(world, "geometric", **told)


@pytest.mark.parametrize("frame", [GL_CAMERA, PC_CAMERA, Y_UP], ids=lambda frame: frame.name)
def test_the_rotations_speak_of_the_axes_that_the_poses_come_in(facing_camera, frame):
    reference = Z_UP if frame.family == "world" else CAMERA
    joints = PoseSequence(facing_camera[None], H36M17, reference.with_(origin="pelvis"))
    poses = change_frame(joints, frame.with_(origin="pelvis"))
    rectified = rectify(poses, "geometric")
    for canonical, R in (
        (rectified.body, rectified.R_source_from_body),
        (rectified.level, rectified.R_source_from_level),
    ):
        np.testing.assert_allclose(rotate(R, canonical.joints.astype(float)), poses.joints, atol=1e-6)
    np.testing.assert_allclose(rectified.body.joints, rectify(joints, "geometric").body.joints, atol=1e-6)
