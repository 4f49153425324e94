"""Rotations: properties that hold for any rotation."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline.core.rotations import angle_deg, geodesic_deg, kabsch, rotate, transpose, zxy_deg

vectors = st.tuples(*[st.floats(-3, 3)] * 3)


@given(vectors, vectors)
def test_rotate_is_the_column_form(rotvec, point):
    R = Rotation.from_rotvec(rotvec)
    got = rotate(R.as_matrix(), np.array([point]))[0]
    np.testing.assert_allclose(got, R.apply(point), atol=1e-9)


def test_rotate_broadcasts_one_rotation_and_one_per_frame():
    rng = np.random.default_rng(0)
    R, x = Rotation.random(5, random_state=0).as_matrix(), rng.normal(size=(5, 17, 3))
    per_frame = rotate(R, x)
    for t in range(5):
        np.testing.assert_allclose(per_frame[t], rotate(R[t], x[t]), atol=1e-12)
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


def test_angles_about_z_x_and_y_give_the_rotation_back():
    angles = np.array([[10.0, 20.0, 30.0], [-170.0, 89.0, 179.0], [0.0, 0.0, -90.0], [25.0, 90.0, 0.0]])
    z, x, y = (Rotation.from_euler(axis, angles[:, [i]], degrees=True) for i, axis in enumerate("zxy"))
    R = (z * x * y).as_matrix()
    R[2] = np.nan
    found = zxy_deg(R)
    np.testing.assert_allclose(found[:2], angles[:2], atol=1e-9)
    assert np.isnan(found[2]).all()
    assert found[3, 1] == pytest.approx(90)
    assert found[3, 0] + found[3, 2] == pytest.approx(25)  # one turn there, about one axis
