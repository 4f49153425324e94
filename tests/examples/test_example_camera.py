"""The example's camera: the signs of heading, pitch and roll, and the truth in its axes."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import Camera, R_camera_from_body, aimed, camera_poses
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.pipeline import BODY, CAMERA, H36M17, change_frame, rotate
from pcnet3d.pipeline.core.rotations import transpose

TARGET = np.array([1.0, 2.0, 1.0])
UP, EAST = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])


def pixel(camera: Camera, point: np.ndarray) -> np.ndarray:
    return camera.project(point[None, None])[0, 0]


def test_an_upright_person_who_faces_the_camera():
    walk = walker(seconds=4.0)
    camera = aimed(walk.root[-1], 4.0, heading_deg=180, pitch_deg=0, roll_deg=0)
    R = R_camera_from_body(walk, camera)[-1]
    np.testing.assert_allclose(R, [[0, -1, 0], [0, 0, -1], [1, 0, 0]], atol=1e-9)


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


def test_a_camera_that_looks_down_stands_above_what_it_looks_at():
    camera = aimed(TARGET, 5.0, heading_deg=30, pitch_deg=15, roll_deg=0)
    assert camera.position[2] == pytest.approx(1 + 5 * np.sin(np.radians(15)))
    assert np.degrees(np.arcsin(-camera.up[2])) == pytest.approx(15)


def test_a_camera_turned_clockwise_sees_up_tilted_to_the_left():
    camera = aimed(TARGET, 5.0, heading_deg=30, pitch_deg=0, roll_deg=10)
    np.testing.assert_allclose(camera.up, [-np.sin(np.radians(10)), -np.cos(np.radians(10)), 0], atol=1e-12)
    assert pixel(camera, TARGET + UP)[0] < 320


def test_points_round_trip(walk, camera):
    back = rotate(transpose(camera.R_camera_from_world), camera.points(walk.world)) + camera.position
    np.testing.assert_allclose(back, walk.world, atol=1e-12)


def test_the_whole_body_is_in_the_image_and_large_enough(walk, camera):
    pixels = camera.project(halpe26(walk))
    assert (pixels > 10).all()
    assert (pixels < np.array([camera.width, camera.height]) - 10).all()
    assert np.ptp(pixels[..., 1], axis=1).min() > 90
    assert camera.points(walk.world)[..., 2].min() > 3


def test_the_camera_is_tilted_and_sees_the_person_from_the_side(walk, camera):
    tilt = np.degrees(np.arccos(-camera.up[1]))
    assert tilt == pytest.approx(15.8, abs=0.2)
    facing = -R_camera_from_body(walk, camera)[:, :, 0]
    off_axis = np.degrees(np.arccos(np.abs(facing[:, 2])))
    assert off_axis.min() > 55
    assert (facing[:, 0] > 0.8).all()


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


def test_in_body_the_person_faces_minus_x_and_stands_along_z(walk, camera):
    poses = camera_poses(walk, camera)
    body = change_frame(poses, BODY, transpose(R_camera_from_body(walk, camera)))
    np.testing.assert_allclose(body.joint("l_hip")[-1], [0, -0.05 * 1.75, 0], atol=1e-6)
    toward_nose = body.joint("nose") - (body.joint("head") + body.joint("thorax")) / 2
    assert (toward_nose[:, 0] < -0.05).all()
    heights = walk.world[..., 2] - walk.root[:, None, 2]
    np.testing.assert_allclose(body.joints[..., 2], heights, atol=1e-6)
    assert body.joints.shape == (240, len(H36M17), 3)
