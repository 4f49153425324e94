"""The example's camera: the signs of heading, pitch and roll, and the truth in its axes."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import Camera, R_camera_from_body, aimed, camera_poses
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.pipeline import CAMERA

TARGET = np.array([1.0, 2.0, 1.0])
UP, EAST = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


def pixel(camera: Camera, point: np.ndarray) -> np.ndarray:
    return camera.project(point[None, None])[0, 0]


@pytest.mark.parametrize("angles", [(0, 0, 0), (70, 15, 5), (-160, -30, 40)])
def test_aiming(angles):
    camera = aimed(TARGET, 5.0, *angles)
    R = camera.R_camera_from_world
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_allclose(pixel(camera, TARGET), [320, 180], atol=1e-9)
    np.testing.assert_allclose(camera.points(TARGET[None, None])[0, 0], [0, 0, 5], atol=1e-12)


def test_looking_north_east_is_right_and_up_is_up():
    camera = aimed(TARGET, 5.0, heading_deg=0, pitch_deg=0, roll_deg=0)
    east, up = pixel(camera, TARGET + EAST), pixel(camera, TARGET + UP)
    np.testing.assert_allclose(east, [320 + 640 / 5, 180], atol=1e-9)
    np.testing.assert_allclose(up, [320, 180 - 640 / 5], atol=1e-9)


def test_camera_poses_are_the_truth_in_camera_axes(walk, camera):
    poses = camera_poses(walk, camera)
    assert poses.frame == CAMERA
    np.testing.assert_array_equal(poses.joint("pelvis"), 0)
    expected = camera.points(walk.world) - camera.points(walk.root[:, None])
    np.testing.assert_allclose(poses.joints, expected, atol=1e-6)
    np.testing.assert_allclose(poses.times, np.arange(240) / 30)


def test_truth_is_the_definition_with_the_cameras_own_up(walk, camera):
    R = R_camera_from_body(walk, camera)
    np.testing.assert_allclose(R, body_axes(camera.points(walk.world), camera.up), atol=1e-9)
    np.testing.assert_allclose(R[:, :, 2], np.broadcast_to(camera.up, (240, 3)), atol=1e-9)
