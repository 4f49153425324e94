"""Ankle and foot angles: known answers, mirror symmetry, what they need."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.bodies import BODY_AND_FEET, facing_camera, with_feet
from pcnet3d.models.angle_error.take_angles import TakeJoints, take_angles
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline import H36M17, rotate
from pcnet3d.pipeline.core.layouts import FEET, body_of
from pcnet3d.pipeline.core.rotations import transpose
from pcnet3d.pipeline.signals.angles import FINE, FOOT_ANGLES, MISSING, UNSEEN, UNTRUSTED, foot_angles

R_BODY_FROM_CAMERA = np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], dtype=float).T
RIGHT = BODY_AND_FEET.indices(["r_big_toe", "r_small_toe", "r_heel"])
R_ANKLE = BODY_AND_FEET.index("r_ankle")


@pytest.fixture
def standing():
    """(1, 23, 3) of BODY_AND_FEET in BODY: shanks vertical, feet flat and straight ahead."""
    body = rotate(R_BODY_FROM_CAMERA, facing_camera()[None])
    knee, ankle = H36M17.indices(["r_knee", "l_knee"]), H36M17.indices(["r_ankle", "l_ankle"])
    body[:, ankle] = body[:, knee] - [0, 0, 0.43]
    return with_feet(body)


def of_feet(body):
    return foot_angles(body, BODY_AND_FEET)


def turned(body, axis, degrees):
    """The body, whose right foot is turned about its ankle."""
    R = Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis, dtype=float)).as_matrix()
    body, ankle = body.copy(), body[:, [R_ANKLE]]
    body[:, RIGHT] = rotate(R, body[:, RIGHT] - ankle) + ankle
    return body


def test_flat_feet_under_vertical_shanks(standing):
    for name, value in of_feet(standing).items():
        assert value == pytest.approx(0, abs=0.1), name


@pytest.mark.parametrize("degrees", [-40, -15, 20])
def test_dorsiflexion(standing, degrees):
    """Toes up is positive; where the foot stands and how the whole body is turned do not matter."""
    raised = turned(standing, [0, 1, 0], degrees)  # y is right: -x, ahead, goes up
    measured = of_feet(raised)
    assert measured["r_ankle_dorsiflexion"] == pytest.approx(degrees, abs=0.1)
    assert measured["l_ankle_dorsiflexion"] == pytest.approx(0, abs=0.1)
    again = of_feet(rotate(Rotation.from_rotvec([0.4, -1.0, 2.0]).as_matrix(), raised))
    assert again["r_ankle_dorsiflexion"] == pytest.approx(degrees, abs=0.1)


@pytest.mark.parametrize("degrees", [-10, 7, 60])
def test_progression(standing, degrees):
    """Toe-out is positive, on both sides alike."""
    outwards = turned(standing, [0, 0, -1], degrees)  # seen from above clockwise
    assert of_feet(outwards)["r_foot_progression"] == pytest.approx(degrees, abs=0.1)
    mirrored = of_feet(outwards[:, BODY_AND_FEET.mirror] * [1, -1, 1])
    assert mirrored["l_foot_progression"] == pytest.approx(degrees, abs=0.1)


def test_a_foot_that_stands_upright_points_nowhere(standing):
    measured = of_feet(turned(standing, [0, 1, 0], -85))
    assert np.isnan(measured["r_foot_progression"])
    assert measured["r_ankle_dorsiflexion"] == pytest.approx(-85, abs=0.1)


def test_the_big_toe_stands_in_where_the_source_gives_no_small_one(standing):
    body = np.repeat(standing, 4, axis=0)
    without = body_of(set(FEET.joints) - {"r_small_toe", "l_small_toe"})
    lacking = foot_angles(body[:, BODY_AND_FEET.indices(without.joints)], without)
    assert np.isfinite(lacking["r_foot_progression"]).all()
    # A toe that comes and goes would otherwise turn the foot by some degrees.
    body[:2, BODY_AND_FEET.index("r_small_toe")] = np.nan
    np.testing.assert_array_equal(np.isfinite(of_feet(body)["r_foot_progression"]), [0, 0, 1, 1])


def test_reasons_and_errors(standing):
    body = np.repeat(standing, 60, axis=0)
    joints = body.copy()
    joints[:10, R_ANKLE] = np.nan
    joints[20:30, BODY_AND_FEET.index("l_heel")] = np.nan
    unseen = np.zeros((60, 23), dtype=bool)
    unseen[:5, R_ANKLE] = True
    R = R_world_from_body(body[:, :17])
    series = take_angles(TakeJoints(joints, joints, R, unseen=unseen, layout=BODY_AND_FEET))
    assert FOOT_ANGLES.keys() <= series.keys()
    right, left = series["r_ankle_dorsiflexion"], series["l_foot_progression"]
    assert right.reason.tolist() == [UNSEEN] * 5 + [MISSING] * 5 + [FINE] * 50
    assert left.reason.tolist() == [FINE] * 20 + [MISSING] * 10 + [FINE] * 30
    assert all(np.isnan(series[name].sd_deg).all() for name in FOOT_ANGLES)
    assert np.isfinite(left.value_deg).sum() == 50
    lost = take_angles(TakeJoints(body, body, R, level_ok=False, layout=BODY_AND_FEET))
    assert (lost["r_foot_progression"].reason == UNTRUSTED).all()
    assert (lost["r_ankle_dorsiflexion"].reason == FINE).all()


def test_no_feet_no_angles_of_them(standing):
    body = standing[:, :17]
    assert not FOOT_ANGLES.keys() & take_angles(TakeJoints(body, body, transpose(np.eye(3))[None])).keys()
