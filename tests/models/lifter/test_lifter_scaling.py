"""Pixels as MotionBERT and VideoPose3D want them."""

import numpy as np

from pcnet3d.models.lifter.scaling import crop_scaled, filled, pixel_scaled, screen_scaled

SIZE = np.array([1920.0, 1080.0])
SURE = np.ones((2, 3))
PIXELS = np.array([[[100, 200], [500, 300], [300, 1000]], [[100, 200], [500, 300], [300, 1000]]], dtype=float)


def test_the_crop_is_one_square_around_all_frames():
    x = crop_scaled(PIXELS, SURE, SIZE)  # 400 wide, 800 high, around (300, 600)
    np.testing.assert_allclose(x[0], [[-0.5, -1], [0.5, -0.75], [0, 1]])
    moved = PIXELS + np.array([[[0, 0]], [[400, 0]]])  # 800 x 800 around (500, 600)
    np.testing.assert_allclose(crop_scaled(moved, SURE, SIZE)[:, 0], [[-1, -1], [0, -1]])


def test_where_the_crop_lies_does_not_matter():
    np.testing.assert_allclose(crop_scaled(PIXELS * 1.7 + 50, SURE, SIZE), crop_scaled(PIXELS, SURE, SIZE))


def test_joints_of_no_confidence_do_not_widen_the_crop():
    wild = PIXELS.copy()
    wild[0, 1] = 5000
    confidence = SURE.copy()
    confidence[0, 1] = 0
    x = crop_scaled(wild, confidence, SIZE)
    np.testing.assert_allclose(x[1], crop_scaled(PIXELS, SURE, SIZE)[1])
    np.testing.assert_allclose(x[0, 1], [1, 1])


def test_the_image_s_corners():
    corners = np.array([[[0.0, 0], [1920, 1080], [960, 540]]])
    np.testing.assert_allclose(screen_scaled(corners, SURE, SIZE)[0], [[-1, -0.5625], [1, 0.5625], [0, 0]])
    np.testing.assert_allclose(
        pixel_scaled(corners, SURE, SIZE)[0], [[-1920 / 1080, -1], [1920 / 1080, 1], [0, 0]]
    )


def test_missing_joints_lie_on_a_line():
    pixels = np.arange(5.0)[:, None, None] * np.array([[10.0, 2.0], [1.0, 1.0], [0, 0]])
    pixels[1:4, 0] = np.nan
    pixels[:, 2] = np.nan
    out = filled(pixels)
    np.testing.assert_allclose(out[:, 0], np.arange(5)[:, None] * [10, 2])
    np.testing.assert_allclose(out[:, 2], out[:, :2].mean(axis=1))
    assert np.isnan(pixels[1, 0, 0])
