"""Up and focal length from segments whose camera is known, without any image."""

import numpy as np
import pytest

from pcnet3d.models.gravity import images as lines
from pcnet3d.models.gravity.images import Segments
from pcnet3d.pipeline.core.camera import pitch_roll_deg, view_rotation
from pcnet3d.pipeline.core.rotations import angle_deg, rotate


def world_segments(seed, pitch, roll, focal, shares=(60, 40, 40, 60), noise_deg=0.5):
    """Segments of edges along the vertical and two horizontal directions, and clutter of any direction, seen by a
    camera; lengths in longer sides of the image."""
    rng = np.random.default_rng(seed)
    R = view_rotation(*(np.array(float(angle)) for angle in (rng.uniform(0, 360), pitch, roll)))
    heading = rng.uniform(0, np.pi)
    axes = np.array(
        [[0, 0, 1], [np.cos(heading), np.sin(heading), 0], [-np.sin(heading), np.cos(heading), 0]]
    )
    directions = rotate(
        R, np.concatenate([np.repeat(axes, shares[:3], axis=0), rng.normal(size=(shares[3], 3))])
    )
    middle = rng.uniform((-0.5, -0.28), (0.5, 0.28), (len(directions), 2))
    shown = focal * directions[:, :2] - middle * directions[:, 2:]
    angle = np.arctan2(shown[:, 1], shown[:, 0]) + np.radians(noise_deg) * rng.normal(size=len(shown))
    angle += np.pi * (rng.uniform(size=len(angle)) < 0.5)  # a segment has no sign
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    sd = np.full(len(shown), np.radians(noise_deg))
    segments = Segments(np.full(len(shown), 0.06), middle, direction, sd, np.ones(len(shown)))
    return segments, R[:, 2]


@pytest.mark.parametrize(
    ("pitch", "roll", "focal"), [(0, 0, 0.8), (15, 5, 0.7), (30, -12, 0.95), (-8, 25, 0.8)]
)
def test_up_and_focal_length_of_a_built_world(pitch, roll, focal):
    segments, up = world_segments(int(pitch + roll), pitch, roll, focal)
    best = lines.fits(segments)[0]
    assert angle_deg(best.up, up) < 0.8
    if abs(pitch) >= 15:
        assert best.focal == pytest.approx(focal, rel=0.06)
    assert (lines.support(segments, best) > 0).all()


def test_a_level_camera_does_not_tell_its_focal_length_and_says_so():
    spreads = {}
    for pitch in (0, 25):
        segments, _ = world_segments(3, pitch, 0, 0.8, shares=(60, 60, 0, 60))
        spreads[pitch] = np.sqrt(lines.fits(segments)[0].covariance[2, 2])
    assert spreads[0] > 2 * spreads[25]


def test_errors_are_about_as_stated():
    ratios = []
    for seed in range(12):
        segments, up = world_segments(seed, 10 + seed, seed - 6, 0.8)
        best = lines.fits(segments)[0]
        ratios.append(np.radians(angle_deg(best.up, up)) / np.sqrt(np.trace(best.covariance[:2, :2])))
    assert (
        np.sqrt(np.mean(np.square(ratios))) < 1.2
    )  # cautious: segments of images are not independent, these are


@pytest.mark.parametrize(("pitch", "roll"), [(0, 0), (20, 13), (-10, -26), (45, 0), (89, 0)])
def test_the_tangent_directions_are_pitch_and_roll(pitch, roll):
    up = view_rotation(np.array(30.0), np.array(float(pitch)), np.array(float(roll)))[:, 2]
    plane = lines.tangent(up)
    np.testing.assert_allclose(plane.T @ plane, np.eye(2), atol=1e-9)
    np.testing.assert_allclose(plane.T @ up, 0, atol=1e-9)
    if abs(pitch) < 40:
        before = pitch_roll_deg(up)
        for axis in (0, 1):
            moved = pitch_roll_deg(up + 1e-4 * plane[:, axis]) - before
            assert moved[axis] > 3 * abs(moved[1 - axis])
