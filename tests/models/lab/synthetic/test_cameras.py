"""Virtual cameras: the truth that they state is the truth."""

import numpy as np
import pytest

from pcnet3d.models.lab.synthetic.cameras import TYPICAL, WILD, Cameras, ViewRange, place
from pcnet3d.pipeline.core.camera import view_rotation


@pytest.fixture
def windows(rng):
    """(40, 25, 17, 3): people of scattered joints that wander over metres."""
    person = rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 1.8], (40, 1, 17, 3))
    return person + np.cumsum(rng.normal(0, 0.05, (40, 25, 1, 3)), axis=1)


def test_everything_is_inside_the_image(windows, rng):
    cameras = place(windows, rng)
    joints = cameras.to_camera(windows)
    pixels = cameras.project(joints)
    assert (joints[..., 2] > 0.9).all()
    assert (pixels >= 0).all()
    assert (pixels <= cameras.image_size[:, None, None]).all()


def test_people_stand_anywhere_in_the_image(windows, rng):
    cameras = place(windows, rng)
    place_in_image = cameras.project(cameras.to_camera(windows)).mean(axis=(1, 2)) / cameras.image_size
    assert (place_in_image.std(axis=0) > 0.1).all()


def test_distances_in_metres_are_kept_where_everything_fits(rng):
    dots = rng.uniform(-0.05, 0.05, (400, 1, 17, 3))  # so small that 2 m are enough for every lens
    views = ViewRange(distance_m=(2.0, 6.0))
    middle = (dots.min(axis=-2) + dots.max(axis=-2)) / 2
    depth = place(dots, rng, views).to_camera(middle[..., None, :])[:, 0, 0, 2]
    assert 2.0 <= depth.min() < 2.1
    assert 5.8 < depth.max() <= 6.0
    assert np.median(depth) == pytest.approx(np.sqrt(12.0), rel=0.1)  # log-uniform


def test_a_distance_at_which_not_everything_fits_becomes_the_least_that_does(windows):
    near, least = (
        place(windows, np.random.default_rng(1), views)
        for views in (ViewRange(distance_m=(0.1, 0.2)), ViewRange(distance=(1.0, 1.0)))
    )
    pixels = near.project(near.to_camera(windows))
    assert (pixels >= 0).all()
    assert (pixels <= near.image_size[:, None, None]).all()
    np.testing.assert_allclose(near.position, least.position)


def test_typical_views_are_level_and_wild_ones_are_the_default(windows, rng):
    assert ViewRange() == WILD
    cameras = place(np.repeat(windows, 10, axis=0), rng, TYPICAL)
    away, right = cameras.R_camera_from_world[:, 0, 2], cameras.R_camera_from_world[:, 0, 0]
    pitch = np.degrees(np.arcsin(-away[:, 2]))
    assert -5 <= pitch.min() < -4
    assert 24 < pitch.max() <= 25
    assert np.degrees(np.arcsin(np.abs(right[:, 2]))).max() <= 5.01


def test_a_camera_one_metre_away_sees_half_a_metre_as_half_the_focal_length():
    R = view_rotation(np.array(90.0), np.array(0.0), np.array(0.0))[None]
    camera = Cameras(R, np.zeros(3), np.array(1000.0), np.array([640.0, 480.0]))
    # Looking along +y: +x of the world is to the right and +z of the world is up, so smaller in pixels.
    pixels = camera.project(camera.to_camera(np.array([[[0.5, 1.0, 0.0], [0.0, 1.0, 0.5]]])))
    np.testing.assert_allclose(pixels, [[[320 + 500, 240], [320, 240 - 500]]])


def test_ranges_are_kept(windows, rng):
    views = ViewRange(pitch_deg=(-30, 45), roll_deg=(-10, 10), focal=(0.65, 2.0))
    cameras = place(np.repeat(windows, 10, axis=0), rng, views)
    away = cameras.R_camera_from_world[:, 0, 2]
    pitch = np.degrees(np.arcsin(-away[:, 2]))
    roll = np.degrees(np.arcsin(cameras.R_camera_from_world[:, 0, 0, 2] / np.cos(np.radians(pitch))))
    assert -30 <= pitch.min() < -25
    assert 40 < pitch.max() <= 45
    assert -10.01 <= roll.min() < -9
    assert 9 < roll.max() <= 10.01
    yaw = np.arctan2(away[:, 1], away[:, 0])
    assert np.abs(np.exp(1j * yaw).mean()) < 0.15  # all around
    ratio = cameras.focal_px / cameras.image_size.max(axis=-1)
    assert ratio.min() >= 0.65
    assert ratio.max() <= 2.0


def test_a_pan_turns_the_camera_and_moves_nothing_else(windows, rng):
    walk = windows + np.linspace(0, 3, 25)[:, None, None] * np.array([1.0, 0, 0])
    cameras = place(walk, rng, ViewRange(pans=1.0))
    R = cameras.R_camera_from_world
    assert R.shape == (40, 25, 3, 3)
    np.testing.assert_allclose(np.linalg.det(R), 1)
    np.testing.assert_allclose(
        np.linalg.norm(cameras.to_camera(walk), axis=-1),
        np.linalg.norm(walk - cameras.position[:, None, None], axis=-1),
    )
    assert (np.abs(R[:, -1] - R[:, 0]).max(axis=(1, 2)) > 0.01).mean() > 0.8
