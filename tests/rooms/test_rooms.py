"""The images that gravity from images is tested on: their truth is what the pixels show."""

import cv2
import numpy as np
import pytest

from pcnet3d.pipeline.core.camera import view_rotation
from rooms import KINDS, no_lines, room, street
from rooms.spoilers import paint_person, through_lens
from rooms.views import Canvas, Plane, View, clip_near

Z = np.array([0, 0, 1.0])


def view(pitch_deg=20.0, roll_deg=7.0, size=(640, 480)) -> View:
    R = view_rotation(np.array(35.0), np.array(pitch_deg), np.array(roll_deg))
    return View(R, np.array([0.0, 0.0, 1.5]), 500.0, size, np.array(size) / 2 + [3, -2])


def segments(image: np.ndarray) -> np.ndarray:
    """(n, 4) the longer segments of an RGB image."""
    found = cv2.createLineSegmentDetector().detect(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))[0]
    found = np.zeros((0, 4)) if found is None else found.reshape(-1, 4)
    return found[np.linalg.norm(found[:, 2:] - found[:, :2], axis=1) > 0.025 * max(image.shape)]


def off_deg(lines: np.ndarray, direction: np.ndarray, focal_px: float, centre: np.ndarray) -> np.ndarray:
    """(n,) degrees between segments and the way from their middles to a camera direction's vanishing point."""
    middle, along = (lines[:, :2] + lines[:, 2:]) / 2, lines[:, 2:] - lines[:, :2]
    wanted = focal_px * direction[:2] - direction[2] * (middle - centre)
    across = wanted[:, 0] * along[:, 1] - wanted[:, 1] * along[:, 0]
    return np.degrees(np.arctan2(np.abs(across), np.abs((wanted * along).sum(axis=1))))


def off_vertical_deg(shot) -> np.ndarray:
    """Of the segments outside of people."""
    lines = segments(shot.image)
    middle = (lines[:, :2] + lines[:, 2:]) / 2
    for x0, y0, x1, y1 in shot.boxes:
        keep = ~((middle >= [x0, y0]) & (middle <= [x1, y1])).all(axis=1)
        lines, middle = lines[keep], middle[keep]
    return off_deg(lines, shot.up, shot.focal_px, np.array(shot.image.shape[1::-1]) / 2)


def test_image_shows_points_where_the_camera_projects_them():
    camera = view()
    canvas = Canvas(camera)
    at = camera.position + 4 * camera.R_camera_from_world[2] + [0.3, 0.4, -0.2]
    right, up = camera.R_camera_from_world[0], camera.R_camera_from_world[1]
    canvas.fill(Plane(at, right, up).rect(-0.1, -0.1, 0.1, 0.1), (255, 255, 255))
    image = through_lens(canvas.image(), camera, 0.0)[..., 0].astype(float)
    rows, columns = np.indices(image.shape)
    middle = np.array([(columns * image).sum(), (rows * image).sum()]) / image.sum()
    np.testing.assert_allclose(middle, camera.project(at[None])[0], atol=0.3)
    assert image.sum() / 255 == pytest.approx((0.2 * 500 / camera.to_camera(at[None])[0, 2]) ** 2, rel=0.06)


def test_floor_that_reaches_behind_the_camera_ends_at_the_horizon():
    camera = view(roll_deg=0.0)
    canvas = Canvas(camera)
    canvas.fill(Plane(np.zeros(3), *np.eye(3)[:2]).rect(-4000, -4000, 4000, 4000), (255, 255, 255))
    image = through_lens(canvas.image(), camera, 0.0)[..., 0]
    horizon = camera.centre[1] - 500 * np.tan(np.radians(20))
    first = np.argmax(image > 0, axis=0)
    np.testing.assert_allclose(first, horizon, atol=1.5)
    assert len(clip_near(np.array([[0, 0, -1.0], [1, 0, -1], [0, 1, -2]]))) == 0


def test_textures_lie_in_their_plane():
    camera = view(roll_deg=0.0)
    canvas = Canvas(camera)
    right = np.array([np.cos(-0.7), np.sin(-0.7), 0])
    wall = Plane(4 * camera.heading - 6 * right, right, Z)
    canvas.textured(wall.rect(0, 0, 12, 4), (200, 200, 200), "bricks")
    lines = segments(through_lens(canvas.image(), camera, 0.0))
    axes = [
        off_deg(lines, camera.R_camera_from_world @ axis, 500.0, camera.centre) < 3 for axis in (right, Z)
    ]
    assert len(lines) > 30
    assert np.mean(axes[0] | axes[1]) > 0.9


def test_lens_shows_at_x_what_a_pinhole_has_at_its_multiple():
    camera = view()
    canvas = Canvas(camera)
    point = np.array([0.4, 0.3])  # r^2 is 0.25
    at = np.append(point, 1.0) @ camera.R_camera_from_world * 3 + camera.position
    right, up = camera.R_camera_from_world[0], camera.R_camera_from_world[1]
    canvas.fill(Plane(at, right, up).rect(-0.02, -0.02, 0.02, 0.02), (255, 255, 255))
    seen = np.argwhere(through_lens(canvas.image(), camera, 0.04)[..., 0] > 60).mean(axis=0)[::-1]
    shown = (seen - camera.centre) / 500
    np.testing.assert_allclose(shown * (1 + 0.04 * (shown**2).sum()), point, atol=0.002)


@pytest.mark.parametrize("shot", [room, street])
def test_truth_is_what_its_angles_say(shot):
    taken = [shot(seed) for seed in range(3)]
    for one in taken:
        R = view_rotation(np.array(0.0), np.array(one.pitch_deg), np.array(one.roll_deg))
        np.testing.assert_allclose(one.up, R[:, 2], atol=1e-9)
        assert -10 <= one.pitch_deg <= 35
        assert 0.65 <= one.focal_px / max(one.image.shape) <= 1.1
        height, width = one.image.shape[:2]
        assert (one.boxes >= 0).all()
        assert (one.boxes <= [width, height, width, height]).all()
        assert (one.boxes[:, 2:] > one.boxes[:, :2]).all()


def test_box_holds_the_person():
    rng = np.random.default_rng(5)
    for _ in range(5):
        camera, image = view(size=(640, 480)), np.zeros((480, 640, 3), np.uint8)
        x0, y0, x1, y1 = paint_person(image, camera, rng).astype(int)
        rows, columns = np.nonzero(image.any(axis=2))
        assert [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1] == [x0, y0, x1, y1]


@pytest.mark.parametrize("kind", KINDS)
def test_without_lines_nothing_points_to_gravity(kind):
    shot = no_lines(kind, 1)
    off = off_vertical_deg(shot)
    assert np.sum(off < 1.5) <= max(2, 0.1 * len(off))
    if kind in ("clouds", "black"):
        assert len(off) == 0
    if kind == "one direction":
        assert len(off) > 10
    if kind == "diagonal pattern":
        assert len(off) > 30
        assert np.percentile(off, 5) > 10
