"""Ankle and foot angles: known answers, mirror symmetry, what they need."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.bodies import facing_camera, feet_of
from pcnet3d.models.angle_error.take_angles import TakeJoints, take_angles
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline import H36M17, rotate
from pcnet3d.pipeline.core.layouts import FEET
from pcnet3d.pipeline.core.rotations import transpose
from pcnet3d.pipeline.signals.angles import FINE, MISSING, UNSEEN, UNTRUSTED
from pcnet3d.pipeline.signals.foot_angles import FOOT_ANGLES, foot_angles

R_BODY_FROM_CAMERA = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], dtype=float).T
RIGHT = FEET.indices(["r_big_toe", "r_small_toe", "r_heel"])


@pytest.fixture
def standing():
    """(1, 17, 3) and (1, 6, 3) in BODY: shanks vertical, feet flat and straight ahead."""
    body = rotate(R_BODY_FROM_CAMERA, facing_camera()[None])
    knee, ankle = H36M17.indices(["r_knee", "l_knee"]), H36M17.indices(["r_ankle", "l_ankle"])
    body[:, ankle] = body[:, knee] - [0, 0, 0.43]
    return body, feet_of(body)


def turned(feet, pivot, axis, degrees):
    """Feet whose right one is turned about a point."""
    R = Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis, dtype=float)).as_matrix()
    feet = feet.copy()
    feet[:, RIGHT] = rotate(R, feet[:, RIGHT] - pivot) + pivot
    return feet


def test_flat_feet_under_vertical_shanks(standing):
    for name, value in foot_angles(*standing).items():
        assert value == pytest.approx(0, abs=0.1), name


@pytest.mark.parametrize("degrees", [-40, -15, 20])
def test_dorsiflexion(standing, degrees):
    """Toes up is positive; where the foot stands and how the whole body is turned do not matter."""
    body, feet = standing
    feet = turned(
        feet, body[:, [H36M17.index("r_ankle")]], [0, 1, 0], degrees
    )  # y is right: -x, ahead, goes up
    found = foot_angles(body, feet)
    assert found["r_ankle_dorsiflexion"] == pytest.approx(degrees, abs=0.1)
    assert found["l_ankle_dorsiflexion"] == pytest.approx(0, abs=0.1)
    R = Rotation.from_rotvec([0.4, -1.0, 2.0]).as_matrix()
    again = foot_angles(rotate(R, body), rotate(R, feet))
    assert again["r_ankle_dorsiflexion"] == pytest.approx(degrees, abs=0.1)


@pytest.mark.parametrize("degrees", [-10, 7, 60])
def test_progression(standing, degrees):
    """Toe-out is positive, on both sides alike."""
    body, feet = standing
    feet = turned(feet, body[:, [H36M17.index("r_ankle")]], [0, 0, -1], degrees)  # seen from above clockwise
    assert foot_angles(body, feet)["r_foot_progression"] == pytest.approx(degrees, abs=0.1)
    mirror = [1, -1, 1]
    seen = foot_angles(body[:, H36M17.mirror] * mirror, feet[:, FEET.mirror] * mirror)
    assert seen["l_foot_progression"] == pytest.approx(degrees, abs=0.1)


def test_a_foot_that_stands_upright_points_nowhere(standing):
    body, feet = standing
    found = foot_angles(body, turned(feet, body[:, [H36M17.index("r_ankle")]], [0, 1, 0], -85))
    assert np.isnan(found["r_foot_progression"])
    assert found["r_ankle_dorsiflexion"] == pytest.approx(-85, abs=0.1)


def test_the_big_toe_stands_in_for_a_small_toe_that_is_never_there(standing):
    body, feet = (np.repeat(points, 4, axis=0) for points in standing)
    small = FEET.indices(["r_small_toe", "l_small_toe"])
    never, sometimes = feet.copy(), feet.copy()
    never[:, small], sometimes[:2, small] = np.nan, np.nan
    assert np.isfinite(foot_angles(body, never)["r_foot_progression"]).all()
    # A toe that comes and goes would otherwise turn the foot by some degrees.
    np.testing.assert_array_equal(
        np.isfinite(foot_angles(body, sometimes)["r_foot_progression"]), [False, False, True, True]
    )


def test_reasons_and_errors(standing):
    body, feet = (np.repeat(points, 60, axis=0) for points in standing)
    joints, seen = body.copy(), feet.copy()
    joints[:10, H36M17.index("r_ankle")] = np.nan
    seen[20:30, FEET.index("l_heel")] = np.nan
    unseen = np.zeros((60, 17), dtype=bool)
    unseen[:5, H36M17.index("r_ankle")] = True
    R = R_world_from_body(body)
    series = take_angles(TakeJoints(joints, joints, R, unseen=unseen, feet=seen, filtered_feet=seen))
    assert FOOT_ANGLES.keys() <= series.keys()
    right, left = series["r_ankle_dorsiflexion"], series["l_foot_progression"]
    assert right.reason.tolist() == [UNSEEN] * 5 + [MISSING] * 5 + [FINE] * 50
    assert left.reason.tolist() == [FINE] * 20 + [MISSING] * 10 + [FINE] * 30
    assert all(np.isnan(series[name].sd_deg).all() for name in FOOT_ANGLES)
    assert np.isfinite(left.value_deg).sum() == 50
    lost = take_angles(TakeJoints(body, body, R, level_ok=False, feet=feet, filtered_feet=feet))
    assert (lost["r_foot_progression"].reason == UNTRUSTED).all()
    assert (lost["r_ankle_dorsiflexion"].reason == FINE).all()


def test_no_feet_no_angles_of_them(standing):
    body, _ = standing
    assert not FOOT_ANGLES.keys() & take_angles(TakeJoints(body, body, transpose(np.eye(3))[None])).keys()
