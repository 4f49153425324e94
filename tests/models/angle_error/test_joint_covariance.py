"""The ellipsoids of joints: what turns the whole body, by known turns."""

import numpy as np
from scipy.spatial.transform import Rotation

from pcnet3d.models.angle_error.joint_covariance import Turns, joint_covariance, levers, turns
from pcnet3d.models.angle_error.joint_noise import JointNoise
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.measures import SD_90
from pcnet3d.pipeline.core.pose import PoseSequence, Rectified
from pcnet3d.pipeline.core.rotations import rotate, transpose, unit

NOISE = JointNoise(np.zeros((0, 14, 3)), turn=(0.9, 1.1, 0.04))
DOWN = Rotation.from_euler(
    "x", -90, degrees=True
).as_matrix()  # R_camera_from_level of a camera that looks level


def test_levers_are_the_covariance_of_drawn_turns_across_the_ray():
    rng = np.random.default_rng(0)
    joints, ray = rng.normal(size=(1, 5, 3)), unit(rng.normal(size=(1, 3)))
    drawn = rng.normal(0, 0.01, (200_000, 3))
    drawn -= (drawn @ ray[0])[:, None] * ray[0]
    moved = np.cross(drawn[:, None], joints)
    found = np.einsum("nji,njk->jik", moved, moved) / len(drawn)
    np.testing.assert_allclose(levers(joints, ray)[0] * 1e-4, found, atol=2e-6)


def test_the_parts_add_as_squares():
    own = np.broadcast_to(np.eye(3) * 0.01, (2, 3, 3, 3))
    joints = np.random.default_rng(1).normal(size=(2, 3, 3))
    turning = Turns(np.array([[0.0, 1, 0]] * 2), np.array([0.0, 0.03]), np.zeros(2), np.array([0.0, 0.5]))
    found = joint_covariance(own, joints, turning, NOISE)
    np.testing.assert_allclose(found[0], 0.81 * own[0], rtol=1e-6)
    by = ((1.1 * 0.03) ** 2 + (0.04 * 0.5) ** 2) * levers(joints, turning.ray)[1]
    np.testing.assert_allclose(found[1], 0.81 * own[1] + by, rtol=1e-5)


def seen_at(off_px: float, focal_sd_px: float = 200.0, below_px: float = 0.0) -> Turns:
    pixels = np.full((4, 17, 2), np.nan)
    pixels[:3] = (
        np.array([1000.0 + off_px, 500.0 + below_px]) + np.linspace(-50, 50, 17)[:, None]
    )  # nobody in the last frame
    keypoints = PoseSequence(pixels, H36M17, IMAGE)
    camera = Camera((2000, 1000), 1000.0, focal_sd_px, "prior")
    return turns(keypoints, camera, np.array([0, 2, 3, 7]), rectified())


def rectified() -> Rectified:
    steep = DOWN @ Rotation.from_euler("x", 30, degrees=True).as_matrix()
    return type("Of", (), {"R_source_from_level": steep})()  # all of it that is looked at


def test_the_focal_length_turns_whom_it_shows_beside_the_axis_by_its_share_of_the_angle():
    share = 0.2 / (1 + SD_90 * 0.2)
    np.testing.assert_allclose(seen_at(500.0).focal, share * 0.5)  # missed frames too: where the others are
    np.testing.assert_allclose(seen_at(0.0).focal, 0.0, atol=1e-12)
    np.testing.assert_allclose(seen_at(500.0, focal_sd_px=0.0).focal, 0.0)
    np.testing.assert_array_less(SD_90 * seen_at(500.0, focal_sd_px=5000.0).focal, 0.5)  # not past the axis
    np.testing.assert_allclose(np.abs(seen_at(0.0).pitch), np.radians(30))


def test_of_that_turn_the_heading_takes_what_is_about_the_vertical():
    share = 0.2 / (1 + SD_90 * 0.2)
    below = seen_at(0.0, below_px=300.0)
    np.testing.assert_allclose(below.heading, 0, atol=1e-9)
    np.testing.assert_allclose(below.focal, share * 0.3)
    np.testing.assert_allclose(seen_at(-500.0).heading, share * 0.5 * np.cos(np.radians(30)))


def test_the_ray_points_at_the_person():
    R = rectified().R_source_from_level
    camera = rotate(R, seen_at(500.0).ray[:, None])[:, 0]
    np.testing.assert_allclose(camera, unit(np.array([[0.5, 0, 1]] * 4)), atol=1e-12)
    np.testing.assert_allclose(rotate(transpose(R), camera[:, None])[:, 0], seen_at(500.0).ray, atol=1e-12)
