"""Velocities in closed form; none across gaps or seams."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pcnet3d.pipeline import H36M17, LEVEL, InputError, PoseSequence
from pcnet3d.stages.trajectories import derivative, trajectory


def test_a_pendulum_has_the_velocity_of_the_formula():
    time_s = np.arange(0, 2, 1 / 240)
    angle = 0.5 * np.sin(2 * np.pi * time_s)
    path = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], -1)
    rate = 0.5 * 2 * np.pi * np.cos(2 * np.pi * time_s)
    expected = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1) * rate[:, None]
    np.testing.assert_allclose(derivative(path, time_s), expected, atol=5e-3)


@given(st.floats(-5, 5), st.floats(-5, 5), st.lists(st.floats(0.01, 0.3), min_size=3, max_size=9))
def test_a_parabola_is_exact_at_any_spacing(speed, accel, steps):
    time_s = np.cumsum(steps)
    path = (speed * time_s + accel * time_s**2 / 2)[:, None]
    np.testing.assert_allclose(derivative(path, time_s)[:, 0], speed + accel * time_s, atol=1e-7)


def test_no_derivative_reaches_across_a_gap_or_a_seam():
    time_s = np.arange(12.0)
    path = np.arange(12.0)[:, None].copy()
    path[6:] += 100  # a step at the seam
    path[3] = np.nan
    speed = derivative(path, time_s, seams=(6,))[:, 0]
    np.testing.assert_array_equal(speed[:3], 1)
    assert np.isnan(speed[3:6]).all()  # the gap itself, and a run of two rows before the seam
    np.testing.assert_array_equal(speed[6:], 1)


def test_no_velocity_across_dropped_frames():
    joints = np.zeros((12, 17, 3))
    joints[6:] = 1
    index = np.r_[0:6, 40:46]
    poses = PoseSequence(joints, H36M17, LEVEL, time_s=index / 30, frame_index=index)
    np.testing.assert_allclose(trajectory(poses, "r_wrist")["r_wrist_speed_mps"], 0, atol=1e-9)


@pytest.mark.parametrize(
    ("unit", "names"), [("m", ["x_m", "vx_mps", "speed_mps"]), ("arbitrary", ["x_au", "vx_aups"])]
)
def test_the_unit_is_in_every_name(unit, names):
    poses = PoseSequence(np.zeros((4, 17, 3)), H36M17, LEVEL.with_(unit=unit), time_s=np.arange(4) / 30)
    columns = trajectory(poses, "r_wrist")
    assert all(f"r_wrist_{name}" in columns for name in names)
    assert all(column.shape == (4,) for column in columns.values())


def test_an_unknown_joint_is_refused():
    poses = PoseSequence(np.zeros((4, 17, 3)), H36M17, LEVEL, time_s=np.arange(4) / 30)
    with pytest.raises(InputError, match="r_wrist"):
        trajectory(poses, "r_hand")
