"""Angles of takes: stated errors against simulated noise, reasons, columns, and what the shipped noise looks like."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import (
    JOINTS,
    JointNoise,
    LiftErrors,
    shipped_noise,
)
from pcnet3d.models.angle_error.take_angles import TakeJoints, smoothed, take_angles
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.pipeline import CAMERA, H36M17, Take
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.core.rotations import rotate, transpose
from pcnet3d.pipeline.signals.angles import ANGLES, angles, near
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.rectify import rectify
from pcnet3d.stages.trajectories import smooth

# The camera looks north, the walker's heading: BODY's back is towards the camera.
R_CAMERA_FROM_WORLD = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
ROWS = H36M17.indices(JOINTS)
WALK = walker(turn_deg=0.0)


@pytest.fixture(scope="module")
def seen():
    """(T, 17, 3) in CAMERA axes and (T, 3, 3) R_camera_from_body, the truth."""
    joints = rotate(R_CAMERA_FROM_WORLD, WALK.world - WALK.root[:, None])
    return joints, R_CAMERA_FROM_WORLD @ R_world_from_body(WALK.world)


@pytest.fixture(scope="module")
def camera_poses(seen):
    return WALK.poses.with_(joints=seen[0], frame=CAMERA.with_(origin="pelvis"), made_by=MadeBy("estimated"))


def taken(joints, R, level_ok=True, noise=None):
    error, filtered = np.full(len(joints), 4.0), smoothed(joints, np.arange(len(joints)) / 30)
    errors = LiftErrors(error, error / 2, noise or shipped_noise())
    return take_angles(TakeJoints(joints, filtered, R, level_ok=level_ok), errors)


def some_noise(size=0.015):
    modes = np.random.default_rng(3).normal(0, 1, (6, len(JOINTS), 3)) * (1, 1, 2)
    return JointNoise(modes * size / np.sqrt(6))


def sd_of(body, R, error, up_error, noise, stated=None):
    errors = LiftErrors(error, up_error, noise, stated)
    return errors.parts(body, R, errors.size(body))


def noise_of(*args):
    """{angle: (T,) what joints and heading make of its error}."""
    return {name: noise for name, (noise, _) in sd_of(*args).items()}


def test_stated_errors_are_those_of_simulated_noise(seen):
    joints, R = (array[60:61].repeat(6000, 0) for array in seen)
    noise = some_noise(0.006)
    body = rotate(transpose(R), joints)
    exact = np.zeros(len(body))
    stated = noise_of(body[:1], R[:1], exact[:1], exact[:1], noise)
    drawn = np.einsum("tk,kji->tji", np.random.default_rng(4).normal(size=(len(body), 6)), noise.modes)
    moved = joints.copy()
    # The modes are shares of the stature that the limbs imply, which is the walker's own.
    moved[:, ROWS] += 1.75 * drawn
    found, true = angles(rotate(transpose(R), moved)), angles(body)
    for name in ANGLES:
        if "elevation" in name:  # near its least value an angle without sign is not Gaussian
            continue
        spread = np.nanstd(near(found[name] - true[name], 0))
        assert stated[name][0] == pytest.approx(spread, rel=0.15, abs=0.1), name


def test_errors_of_up_and_heading_reach_only_what_depends_on_them(seen):
    joints, R = seen
    body = rotate(transpose(R), joints)
    still = JointNoise(np.zeros((1, len(JOINTS), 3)))
    up, none = np.full(len(body), 5.0), np.zeros(len(body))
    found = sd_of(body, R, np.sqrt(np.pi) / 2 * up, up, still)  # all of the error is up's
    for name, angle in ANGLES.items():
        if not angle.needs_gravity:
            np.testing.assert_allclose(found[name], 0, atol=1e-6, err_msg=name)
        np.testing.assert_allclose(found[name][0], 0, atol=1e-6, err_msg=name)
    # A tilt to the front by 5 / sqrt(2) degrees, root mean square, tilts the trunk by as much.
    np.testing.assert_allclose(found["trunk_lean_sagittal"][1], 5 / np.sqrt(2), atol=0.02)
    exact = sd_of(body, R, none, none, still)
    assert all(np.nanmax(values) < 1e-6 for values in exact.values())


def test_a_lifter_that_is_unsure_widens_the_bars(seen):
    joints, R = seen
    noise = replace(some_noise(), powers=(0.0, 0.0, 1.0))
    zero = np.zeros(len(joints))
    bars = [
        noise_of(rotate(transpose(R), joints), R, zero, zero, noise, zero + times * noise.usual[2])[
            "l_knee_flexion"
        ]
        for times in (1, 1.5)
    ]
    np.testing.assert_allclose(bars[1], 1.5 * bars[0], rtol=0.1)
    unknown = noise_of(rotate(transpose(R), joints), R, zero, zero, noise, zero + np.nan)["l_knee_flexion"]
    np.testing.assert_array_equal(unknown, bars[0])


def test_shipped_noise_is_larger_in_depth_and_far_out():
    noise = shipped_noise()
    variance = (noise.modes**2).sum(axis=0)
    limbs = [
        JOINTS.index(f"{side}_{joint}") for side in "rl" for joint in ("knee", "ankle", "elbow", "wrist")
    ]
    assert (variance[limbs, 2] > 1.5 * variance[limbs, :2].max(axis=1)).all()
    assert variance[JOINTS.index("r_wrist")].sum() > variance[JOINTS.index("r_shoulder")].sum()
    assert set(noise.factors) == set(ANGLES), "fit: pcnet3d lab evaluate errors --fit"
    assert {joint for angle in ANGLES.values() for joint in angle.joints} <= set(JOINTS)
    assert all(0.3 < factor < 2 for factor in noise.factors.values())
    assert all(power > 0 for power in noise.powers)


def test_reasons(seen):
    joints, R = seen[0].copy(), seen[1].copy()
    joints[10, H36M17.index("r_ankle")] = np.nan
    joints[50, H36M17.index("l_ankle")] = np.nan
    joints[54, H36M17.index("l_ankle")] = np.nan  # three rows in between: too short for the filter
    R[90] = np.nan
    found = taken(joints, R)
    assert found["r_knee_flexion"].reason[10] == 1
    assert found["l_knee_flexion"].reason[50:55].tolist() == [1, 4, 4, 4, 1]
    assert found["trunk_lean_sagittal"].reason[90] == 3
    assert found["r_knee_flexion"].reason[90] == 0  # needs no gravity
    for series in found.values():
        assert series.reason.dtype == np.int8
        assert (np.isnan(series.value_deg) == (series.reason != 0)).all()
        assert (np.isnan(series.sd_deg) == (series.reason != 0)).all()
    refused = taken(joints, R, level_ok=False)
    assert {int(r) for r in refused["pelvis_obliquity"].reason} == {3}
    assert refused["r_elbow_flexion"].reason[20] == 0
    vague = taken(joints, R, noise=some_noise(0.3))
    assert (vague["r_elbow_flexion"].reason[20:40] > 0).all()


def test_an_arm_along_its_axis_has_a_reason(seen):
    joints, R = seen[0][:60].copy(), seen[1][:60]
    shoulder, elbow = (joints[:, H36M17.index(f"r_{joint}")] for joint in ("shoulder", "elbow"))
    right = rotate(R, np.array([[0.0, 1, 0]]))[:, 0]
    joints[:, H36M17.index("r_elbow")] = shoulder + np.linalg.norm(elbow - shoulder, axis=-1)[:, None] * right
    found = taken(joints, R, noise=some_noise(0.001))
    assert (found["r_shoulder_flexion"].reason == 2).all()
    assert (found["r_shoulder_abduction"].reason == 0).all()


def _angles(poses, rectified, filtered):
    return Angles()(Take("t", poses=poses, rectified=rectified, filtered=filtered)).kinematics


def test_walker_through_the_stages_in_its_own_gravity():
    rectified = rectify(WALK.poses)
    columns = _angles(WALK.poses, rectified, smooth(rectified.level)[0])
    inner = slice(10, -10)
    for name in ("r_knee_flexion", "l_elbow_flexion", "r_thigh_trunk_flexion", "l_shoulder_flexion"):
        true = WALK.angles_deg[f"{name}_deg"]
        np.testing.assert_allclose(columns[f"{name}_deg"][inner], true[inner], atol=0.5, err_msg=name)
        rate = np.gradient(true, WALK.time_s)
        assert np.abs(columns[f"{name}_degps"] - rate)[inner].max() < 0.06 * np.ptp(rate)
        assert np.ptp(columns[f"{name}_deg"]) == pytest.approx(np.ptp(true), abs=1.0)
    lean = WALK.angles_deg["trunk_lean_deg"]
    np.testing.assert_allclose(columns["trunk_lean_sagittal_deg"][inner], lean[inner], atol=0.5)
    assert np.isnan(columns["r_knee_flexion_sd_deg"]).all()  # no lifter made these joints


def test_the_stage_adds_its_columns_and_says_what_is_missing(camera_poses):
    joints = camera_poses.joints.copy()
    joints[30:40, H36M17.index("r_wrist")] = np.nan
    poses = camera_poses.with_(joints=joints, made_by=MadeBy("estimated", shipped_noise().lifter))
    rectified = rectify(poses, "geometric", gravity=(0, 1, 0))
    old = {"r_wrist_x": np.zeros(len(poses))}
    take = Take("t", poses=poses, rectified=rectified, filtered=smooth(rectified.level)[0], kinematics=old)
    done = Angles()(take)
    assert done.kinematics is not None
    assert take.kinematics == old
    assert "r_wrist_x" in done.kinematics
    for name in ANGLES:
        for suffix in ("_deg", "_sd_deg", "_degps", "_reason"):
            assert done.kinematics[name + suffix].shape == (len(poses),)
    assert (done.kinematics["r_elbow_flexion_reason"][30:40] == 1).all()
    assert any("r_elbow_flexion (10)" in e.text and "a joint is missing" in e.text for e in done.notices)
    fine = done.kinematics["r_knee_flexion_reason"] == 0
    assert (done.kinematics["r_knee_flexion_sd_deg"][fine] > 0.5).all()


def test_rates_are_not_taken_where_an_angle_steps_around_or_a_clip_boundary_is(camera_poses):
    poses = camera_poses.with_(seams=(100,))
    rectified = rectify(poses, "geometric", gravity=(0, 1, 0))
    level = rectified.level
    jumped = level.joints.copy()
    jumped[100:] = jumped[60]
    columns = _angles(poses, rectified, level.with_(joints=jumped))
    assert np.abs(columns["r_knee_flexion_degps"][100:]).max() < 1e-3


def test_angles_do_not_flip_when_a_person_turns():
    poses = walker(seconds=4).poses
    turn = Rotation.from_euler("z", np.linspace(0, 400, len(poses))[:, None], degrees=True).as_matrix()
    walks, turns = (
        _angles(of, rectified := rectify(of, "geometric"), rectified.level)
        for of in (poses, poses.with_(joints=rotate(turn, poses.joints), path=None))
    )
    for name in ANGLES:
        np.testing.assert_allclose(turns[f"{name}_deg"], walks[f"{name}_deg"], atol=1e-3, err_msg=name)
