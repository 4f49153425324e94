"""Calibrated cameras: rays through known lenses come back."""

import cv2
import numpy as np
import pytest

from golden.cameras import SIZE
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.intrinsics import Intrinsics, undistorted, undistorted_image

LENSES = {
    "none": Intrinsics((900.0, 950.0), (600.0, 380.0), (), image_size=SIZE),
    "barrel": Intrinsics((800.0, 810.0), (630.0, 365.0), (-0.3, 0.1, 0.001, -0.002, 0.01), image_size=SIZE),
    "pincushion": Intrinsics((1100.0, 1100.0), (640.0, 350.0), (0.25, 0.05, 0, 0), image_size=SIZE),
    "rational": Intrinsics((700, 700), (640, 360), (5.0, 2.0, 0, 0, 0.1, 5.2, 3.5, 0.4), image_size=SIZE),
    "thin prism": Intrinsics(
        (900, 900), (640, 360), (-0.1, 0.02, 1e-3, 1e-3, 0, 0, 0, 0, 1e-3, 2e-3, -1e-3, 3e-3), image_size=SIZE
    ),
    "fisheye": Intrinsics((500, 505), (645, 355), (-0.02, 0.01, -0.003, 0.001), True, SIZE),
}


def filmed(rays: np.ndarray, lens: Intrinsics) -> np.ndarray:
    """(N, 2) pixels of rays x / z, y / z by OpenCV's own projections."""
    points, still = np.column_stack([rays, np.ones(len(rays))])[:, None], np.zeros(3)
    coefficients = np.array(lens.distortion or (0.0,) * 4)
    project = cv2.fisheye.projectPoints if lens.fisheye else cv2.projectPoints
    return project(points, still, still, lens.matrix, coefficients)[0][:, 0]


@pytest.mark.parametrize("name", LENSES)
def test_known_rays_come_back(name):
    lens = LENSES[name]
    reach = 2.5 if lens.fisheye else 0.7
    rays = np.random.default_rng(0).uniform(-reach, reach, (500, 2)) * (1, 0.6)
    expected = rays * lens.pinhole_focal_px + np.array(SIZE) / 2
    np.testing.assert_allclose(undistorted(filmed(rays, lens), lens), expected, atol=0.01)


def test_missing_points_stay_missing_and_shapes_stay():
    points = np.full((3, 2, 17, 2), 300.0)
    points[1, 0, 5, 0] = np.nan
    points[2, 1, 3] = np.nan
    found = undistorted(points, LENSES["barrel"])
    assert found.shape == points.shape
    np.testing.assert_array_equal(np.isnan(found).any(axis=-1), np.isnan(points).any(axis=-1))
    assert undistorted(np.empty((0, 2)), LENSES["barrel"]).shape == (0, 2)


def test_points_that_the_lens_cannot_have_drawn_go_missing():
    """With k1 alone, x (1 - 0.3 x^2) never exceeds 0.703; a fisheye of 500 px shows 90 degrees at 785 px."""
    lens = Intrinsics((1000, 1000), (640, 360), (-0.3, 0, 0, 0), image_size=SIZE)
    x = 640 + 1000 * np.array([0.65, 0.69, 0.72, 0.9])
    found = undistorted(np.column_stack([x, np.full(4, 360.0)]), lens)
    np.testing.assert_array_equal(np.isnan(found[:, 0]), [False, False, True, True])
    fisheye = Intrinsics((500, 500), (640, 360), (0, 0, 0, 0), True, SIZE)
    far = undistorted([[640 + 750, 360], [640 + 800, 360]], fisheye)
    np.testing.assert_allclose(far[0], [640 + 500 * np.tan(1.5), 360], rtol=1e-4)
    assert np.isnan(far[1]).all()


def test_coefficients_that_are_whole_numbers_are_those_of_the_same_floats():
    """OpenCV took them for floats, and read what stood behind them in memory."""
    rays = np.random.default_rng(0).uniform(-2, 2, (500, 2))
    for _ in range(50):
        whole, same = (
            Intrinsics((500, 500), (640, 360), zeros, True, SIZE) for zeros in ((0,) * 4, (0.0,) * 4)
        )
        np.testing.assert_array_equal(
            undistorted(filmed(rays, same), whole), undistorted(filmed(rays, same), same)
        )


@pytest.mark.parametrize("name", LENSES)
def test_the_image_goes_where_its_points_go(name):
    lens = LENSES[name]
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    point = np.array([[500.0, 250.0]])
    cv2.circle(image, (500, 250), 6, (255, 255, 255), -1, cv2.LINE_AA)
    seen = undistorted_image(image, lens)
    assert seen.shape == image.shape
    rows, columns = np.nonzero(seen[..., 0] > 128)
    np.testing.assert_allclose([[columns.mean(), rows.mean()]], undistorted(point, lens), atol=0.6)


def test_without_a_size_nothing_is_undone():
    with pytest.raises(InputError, match=r"c\.toml: expected an image size of camera 'left', got none"):
        undistorted(np.zeros((1, 2)), Intrinsics((900, 900), (640, 360), name="left", source="c.toml"))
