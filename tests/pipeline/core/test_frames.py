"""Frames and rotations: words, handedness, the one change of frame, and what holds for any rotation."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import (
    CAMERA,
    H36M17,
    IMAGE,
    LEVEL,
    Y_UP,
    Z_UP,
    Frame,
    InputError,
    PoseSequence,
    change_frame,
    rotate,
)
from pcnet3d.pipeline.core.frames import FRAMES, GL_CAMERA, PC_CAMERA
from pcnet3d.pipeline.core.rotations import (
    angle_deg,
    geodesic_deg,
    kabsch,
    shortest_turn,
    transpose,
    unit,
    zxy_deg,
)
from refusals import refused


@pytest.fixture
def poses() -> PoseSequence:
    joints = np.random.default_rng(0).normal(size=(4, 17, 3))
    return PoseSequence(joints, H36M17, CAMERA.with_(origin="camera"))


@pytest.mark.parametrize(
    "frame", [frame for frame in FRAMES.values() if frame.dims == 3], ids=lambda f: f.name
)
def test_every_named_3d_frame_is_right_handed(frame):
    assert frame.right_handed


def test_camera_axes_follow_formats_md(poses):
    x, y, z = np.moveaxis(poses.joints, -1, 0)
    gl = change_frame(poses, GL_CAMERA.with_(origin="camera")).joints
    np.testing.assert_array_equal(gl, np.stack([x, -y, -z], -1))
    pc = change_frame(poses, PC_CAMERA.with_(origin="camera")).joints
    np.testing.assert_array_equal(pc, np.stack([z, -x, -y], -1))


def test_y_up_to_z_up_is_the_cyclic_map():
    joints = np.random.default_rng(1).normal(size=(2, 17, 3)).astype(np.float32)
    turned = change_frame(PoseSequence(joints, H36M17, Y_UP), Z_UP).joints
    np.testing.assert_array_equal(turned, joints[..., [2, 0, 1]])


def test_a_reflected_source_is_reflected_back():
    """MMPose's (-x, z, -y) is left-handed (formats.md section 3); its words alone undo it."""
    joints = np.random.default_rng(2).normal(size=(2, 17, 3)).astype(np.float32)
    mirrored = Frame("MMPOSE", "camera", ("left", "away", "up"))
    assert not mirrored.right_handed
    written = np.stack([-joints[..., 0], joints[..., 2], -joints[..., 1]], -1)
    np.testing.assert_array_equal(
        change_frame(PoseSequence(written, H36M17, mirrored), CAMERA).joints, joints
    )


def test_pelvis_and_units(poses):
    centred = change_frame(poses, CAMERA.with_(unit="mm"))
    np.testing.assert_allclose(
        centred.joints, (poses.joints - poses.joints[:, :1]) * 1000, rtol=1e-5, atol=1e-3
    )
    assert (centred.joint("pelvis") == 0).all()


@pytest.mark.parametrize(
    ("to", "words"),
    [
        (LEVEL, ["CAMERA", "LEVEL", "rotation"]),
        (CAMERA.with_(origin="camera", unit="arbitrary"), ["scale"]),
        (CAMERA.with_(origin="world"), ["origin"]),
        (IMAGE, ["CAMERA", "IMAGE"]),
    ],
)
def test_what_cannot_be_known_is_refused_in_words(poses, to, words):
    with refused(None, *words, "x right, y down, z away"):
        change_frame(poses, to)


def test_dependent_or_unknown_axes_are_refused():
    for axes in permutations(("right", "left", "up"), 3):
        with pytest.raises(InputError):
            Frame("BAD", "camera", axes)
    with pytest.raises(InputError, match="north"):
        Frame("BAD", "camera", ("north", "up", "right"))
    with pytest.raises(InputError, match="level, body; got sea and up"):
        Frame("BAD", "sea", ("up",))


def test_a_long_sequence_is_turned_like_its_parts():
    """Rows are turned by the thousand; each has its own rotation here."""
    rng = np.random.default_rng(0)
    poses = PoseSequence(rng.normal(size=(9000, 17, 3)), H36M17, CAMERA.with_(origin="camera"))
    R = Rotation.random(9000, rng=rng).as_matrix()
    level = change_frame(poses, LEVEL, R)
    expected = rotate(R, poses.joints.astype(float) - poses.joints[:, :1])
    np.testing.assert_allclose(level.joints, expected, atol=1e-6)


def test_covariances_turn_with_the_axes_and_scale_with_the_unit(poses):
    rng = np.random.default_rng(0)
    root = rng.normal(size=(*poses.joints.shape, 3))
    covariance = root @ np.swapaxes(root, -1, -2)
    stated = poses.with_(covariance=covariance)
    turned = change_frame(stated, GL_CAMERA.with_(unit=poses.frame.unit, origin=poses.frame.origin))
    flip = np.diag([1.0, -1.0, -1.0])
    np.testing.assert_allclose(turned.covariance, flip @ covariance @ flip, rtol=1e-5, atol=1e-5)


def test_rotate_is_the_column_form_of_one_rotation_and_of_one_per_frame():
    rng = np.random.default_rng(0)
    R, x = Rotation.random(5, random_state=0).as_matrix(), rng.normal(size=(5, 17, 3))
    per_frame = rotate(R, x)
    for t in range(5):
        np.testing.assert_allclose(per_frame[t], Rotation.from_matrix(R[t]).apply(x[t]), atol=1e-12)
        np.testing.assert_allclose(rotate(R[t], x)[t], per_frame[t], atol=1e-12)
    np.testing.assert_allclose(rotate(transpose(R), per_frame), x, atol=1e-12)


def test_geodesic_is_exact_from_0_to_180():
    for degrees in [0, 1e-4, 1e-2, 3, 90, 179, 179.9999, 180]:
        R = Rotation.from_rotvec(np.radians(degrees) * np.array([2, -1, 2]) / 3).as_matrix()
        base = Rotation.random(random_state=1).as_matrix()
        assert geodesic_deg(base, rotate(base, R.T).T) == pytest.approx(degrees, abs=1e-6)


def test_angle_deg_of_known_vectors():
    assert angle_deg(np.array([1, 0, 0]), np.array([1e-7, 0, 0])) == 0
    assert angle_deg(np.array([1, 0, 0]), np.array([-2, 0, 0])) == pytest.approx(180)
    assert angle_deg(np.array([1, 0, 0]), np.array([1, 1, 0])) == pytest.approx(45)


def test_kabsch_finds_the_rotation_whatever_the_shift_and_a_missing_joint():
    rng = np.random.default_rng(2)
    R_a_from_b = Rotation.random(4, random_state=3).as_matrix()
    b = rng.normal(size=(4, 17, 3))
    a = rotate(R_a_from_b, b) + rng.normal(size=(4, 1, 3))
    a[1, 3] = np.nan
    np.testing.assert_allclose(kabsch(a, b), R_a_from_b, atol=1e-9)


def test_kabsch_never_reflects_and_needs_three_points():
    b = np.random.default_rng(4).normal(size=(17, 3))
    assert np.linalg.det(kabsch(b * [-1, 1, 1], b)) == pytest.approx(1)
    two = np.full((17, 3), np.nan)
    two[:2] = b[:2]
    assert np.isnan(kabsch(two, b)).all()


def test_the_shortest_turn_is_that_of_scipy_and_of_opposite_directions_none():
    for a, b in np.random.default_rng(5).normal(size=(20, 2, 3)):
        known = Rotation.align_vectors(unit(a)[None], unit(b)[None])[0].as_matrix()
        np.testing.assert_allclose(shortest_turn(a, b), known, atol=1e-12)
        np.testing.assert_allclose(shortest_turn(a, -a), np.eye(3), atol=1e-6)


def test_angles_about_z_x_and_y_give_the_rotation_back():
    angles = np.array([[10.0, 20.0, 30.0], [-170.0, 89.0, 179.0], [0.0, 0.0, -90.0], [25.0, 90.0, 0.0]])
    z, x, y = (Rotation.from_euler(axis, angles[:, [i]], degrees=True) for i, axis in enumerate("zxy"))
    found = zxy_deg((z * x * y).as_matrix())
    np.testing.assert_allclose(found[:3], angles[:3], atol=1e-9)
    assert found[3, 1] == pytest.approx(90)
    assert found[3, 0] + found[3, 2] == pytest.approx(25)  # one turn there, about one axis
