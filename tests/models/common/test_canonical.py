"""The definition of BODY: exact on a known person, the same in every frame of axes, NaN where it cannot be had."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.common.canonical import body_axes
from pcnet3d.pipeline import H36M17, rotate

UP_IN_CAMERA = np.array([0.0, -1.0, 0.0])


def bodies(rows: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(5)
    return rng.normal(size=(rows, 17, 3)), rng.normal(size=(rows, 3))


def test_an_upright_person_who_faces_the_camera(facing_camera):
    R = body_axes(facing_camera[None], UP_IN_CAMERA)
    np.testing.assert_allclose(R[0], [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-12)


def test_hips_and_shoulders_count_alike_whatever_their_widths(facing_camera):
    turned = facing_camera.copy()
    hips = H36M17.indices(["l_hip", "r_hip"])
    turned[hips] = rotate(Rotation.from_euler("y", 30, degrees=True).as_matrix(), turned[hips])
    expected = Rotation.from_euler("y", 15, degrees=True).as_matrix() @ body_axes(
        facing_camera[None], UP_IN_CAMERA
    )
    np.testing.assert_allclose(body_axes(turned[None], UP_IN_CAMERA), expected, atol=1e-12)


def test_any_axes_origin_and_unit():
    joints, up = bodies(20)
    R = body_axes(joints, up)
    Q = Rotation.random(20, rng=np.random.default_rng(6)).as_matrix()
    moved = 7.0 * rotate(Q, joints) + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(body_axes(moved, 0.1 * rotate(Q, up[:, None])[:, 0]), Q @ R, atol=1e-9)


def test_is_a_rotation_whose_last_column_is_up():
    joints, up = bodies(20)
    R = body_axes(joints, up)
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-12)
    np.testing.assert_allclose(R[:, :, 2], up / np.linalg.norm(up, axis=1, keepdims=True), atol=1e-12)


@pytest.mark.parametrize("joint", ["l_hip", "r_hip", "l_shoulder", "r_shoulder"])
def test_a_missing_joint_makes_its_frame_nan(joint):
    joints, up = bodies(3)
    joints[1, H36M17.index(joint), 2] = np.nan
    R = body_axes(joints, up)
    assert np.isnan(R[1]).all()
    assert np.isfinite(R[[0, 2]]).all()


def test_other_joints_do_not_matter():
    joints, up = bodies(3)
    expected = body_axes(joints, up)
    torso = H36M17.indices(["l_hip", "r_hip", "l_shoulder", "r_shoulder"])
    joints[:, np.setdiff1d(np.arange(17), torso)] = np.nan
    np.testing.assert_array_equal(body_axes(joints, up), expected)


def test_an_unknown_up_and_a_body_on_its_side_are_nan(facing_camera):
    sideways = np.array([1.0, 0.0, 0.0])  # up along the line from hip to hip
    assert np.isnan(body_axes(facing_camera[None], sideways)).all()
    assert np.isnan(body_axes(facing_camera[None], np.full(3, np.nan))).all()
