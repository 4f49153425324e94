"""Velocities in closed form; none across gaps or seams."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.pipeline import CAMERA, H36M17, LEVEL, InputError, PoseSequence, Take
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages import rectify
from pcnet3d.stages.trajectories import FINE, MISSING, UNCERTAIN, Trajectories, smooth, trajectory, unit_of

JUDGED = MadeBy("estimated", shipped_noise().lifter)


def test_no_velocity_across_dropped_frames():
    joints = np.zeros((12, 17, 3))
    joints[6:] = 1
    index = np.r_[0:6, 40:46]
    poses = PoseSequence(joints, H36M17, LEVEL, time_s=index / 30, frame_index=index)
    np.testing.assert_allclose(trajectory(poses, "r_wrist")["r_wrist_speed"], 0, atol=1e-9)


def test_what_a_panning_camera_leaves_of_a_path():
    """Heights and horizontal distances hold; the pan enters the horizontal velocity: rate times distance."""
    time_s = np.arange(60) / 30
    x, z = 0.5 + 0 * time_s, np.sin(time_s)
    pan = np.radians(30) * time_s

    def columns(angle):
        joints = np.zeros((60, 17, 3))
        joints[:, H36M17.index("r_wrist")] = np.stack([x * np.cos(angle), x * np.sin(angle), z], -1)
        return trajectory(PoseSequence(joints, H36M17, LEVEL, time_s=time_s), "r_wrist")

    still, panning = columns(0 * pan), columns(pan)
    for name in ("r_wrist_z", "r_wrist_vz"):
        np.testing.assert_allclose(panning[name], still[name], atol=1e-6)
    np.testing.assert_allclose(np.hypot(panning["r_wrist_x"], panning["r_wrist_y"]), x, atol=1e-6)
    np.testing.assert_allclose(panning["r_wrist_distance"], still["r_wrist_distance"], atol=1e-6)
    false_mps = np.hypot(panning["r_wrist_vx"], panning["r_wrist_vy"])
    np.testing.assert_allclose(false_mps, 0.26, atol=0.005)


@pytest.mark.parametrize(("camera", "notes"), [("static", 0), ("moving", 1)])
def test_the_stage_says_that_a_moving_camera_makes_directions_relative(facing_camera, camera, notes):
    poses = PoseSequence(np.tile(facing_camera, (12, 1, 1)), H36M17, CAMERA, time_s=np.arange(12) / 30)
    take = Trajectories()(Take("t", poses=poses, rectified=rectify(poses, "geometric", camera)))
    assert len([event for event in take.notices if "relative to it" in event.text]) == notes


def wave(hz: float, fps: float = 60, seconds: float = 4, frame=LEVEL) -> PoseSequence:
    """Every joint swings along x with an amplitude of 0.1."""
    time_s = np.arange(round(seconds * fps)) / fps
    joints = np.zeros((len(time_s), 17, 3))
    joints[..., 0] = 0.1 * np.sin(2 * np.pi * hz * time_s)[:, None]
    return PoseSequence(joints, H36M17, frame, time_s=time_s, frame_index=np.arange(len(time_s)))


def test_columns_are_the_filtered_path_and_its_derivatives():
    slow = smooth(wave(1.0))[0]
    columns = trajectory(slow, "l_ankle")
    middle = slice(60, 180)
    rate, time_s = 2 * np.pi, slow.times[middle]
    expected = (np.sin(rate * time_s), rate * np.cos(rate * time_s), -(rate**2) * np.sin(rate * time_s))
    for name, values in zip(("x", "vx", "ax"), expected, strict=True):
        np.testing.assert_allclose(columns[f"l_ankle_{name}"][middle], 0.1 * values, atol=2e-3 * rate**2)
    np.testing.assert_allclose(columns["l_ankle_speed"], np.abs(columns["l_ankle_vx"]), atol=1e-9)
    fast = smooth(wave(20.0))[0]
    assert np.abs(trajectory(fast, "l_ankle")["l_ankle_x"][middle]).max() < 0.002


@pytest.mark.parametrize("fps", [13, 24, 25, 30, 50])
def test_what_was_filtered_is_in_the_history_at_any_usual_frame_rate(fps):
    """Takes of 24 and 25 frames a second were once refused, when the long work was done."""
    smoothed = smooth(wave(0.3 * fps, fps=fps))[0]
    done = smoothed.history[-1].options
    assert (done["filter"], done["cutoff_hz"], done["values_lost"]) == ("butterworth", 6.0, 0)
    assert np.isfinite(smoothed.joints).all()


def stage(facing_camera, rows: int, fps: float, **options) -> Take:
    sway = 0.05 * np.sin(2 * np.pi * np.arange(rows) / fps)[:, None, None] * np.array([1.0, 0, 0])
    joints = np.tile(facing_camera, (rows, 1, 1))
    joints[:, H36M17.index("r_wrist")] += sway[:, 0]
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=np.arange(rows) / fps)
    return Trajectories(**options)(Take("t", poses=poses, rectified=rectify(poses, "geometric")))


def codes(take) -> list[str]:
    return [event.code for event in take.notices]


@pytest.mark.parametrize("cutoff_hz", [None, 6.0])
def test_a_single_frame_has_no_path(facing_camera, cutoff_hz):
    take = stage(facing_camera, 1, 30, cutoff_hz=cutoff_hz)
    assert np.isnan(take.kinematics["r_wrist_speed"]).all()
    assert codes(take) == []
    level = PoseSequence(facing_camera[None], H36M17, LEVEL, time_s=np.zeros(1))
    assert smooth(level, cutoff_hz)[0].history[-1].options["unfiltered"]


def test_a_take_too_short_for_the_filter_has_nan_and_a_warning(facing_camera):
    take = stage(facing_camera, 8, 30, cutoff_hz=6.0)
    assert np.isnan(take.kinematics["r_wrist_x"]).all()
    assert "pieces-too-short" in codes(take)


def test_a_frame_rate_that_does_not_carry_the_usual_filter_is_said(facing_camera):
    take = stage(facing_camera, 40, 10)
    assert "not-filtered" in codes(take)
    assert np.isfinite(take.kinematics["r_wrist_x"]).all()
    with pytest.raises(InputError, match="Nyquist"):
        stage(facing_camera, 40, 10, cutoff_hz=6.0)


def test_nothing_is_taken_across_a_refused_frame(facing_camera):
    joints = np.tile(facing_camera, (60, 1, 1))
    joints[30:, :, 0] += 0.2 * (np.arange(17) > 0)  # everything but the pelvis jumps
    joints[30, H36M17.index("r_hip")] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=np.arange(60) / 30)
    take = Trajectories()(Take("t", poses=poses, rectified=rectify(poses, "geometric")))
    speed = take.kinematics["r_wrist_speed"]
    assert np.flatnonzero(np.isnan(speed)).tolist() == [30]
    np.testing.assert_allclose(np.delete(speed, 30), 0, atol=1e-4)


def test_the_root_moves_in_level_when_the_source_knows_its_place(facing_camera):
    time_s = np.arange(60) / 30
    place = np.stack([0.3 + 0 * time_s, 0.1 + 0 * time_s, 5 - 1.2 * time_s], -1)  # towards the camera
    frame = CAMERA.with_(origin="camera")
    poses = PoseSequence(facing_camera + place[:, None], H36M17, frame, time_s=time_s)
    rectified = rectify(poses, "geometric")
    columns = Trajectories()(Take("t", poses=poses, rectified=rectified)).kinematics
    start, forward = (
        rectified.R_source_from_level.T @ place[0],
        rectified.R_source_from_level.T @ [0, 0, -1.2],
    )
    for axis, first, speed in zip("xyz", start, forward, strict=True):
        np.testing.assert_allclose(columns[f"root_v{axis}"], speed, atol=1e-3)
        np.testing.assert_allclose(columns[f"root_{axis}"], first + speed * time_s, atol=1e-3)
    still = poses.with_(joints=np.tile(facing_camera, (60, 1, 1)), frame=CAMERA)
    assert (
        "root_x"
        not in Trajectories()(Take("t", poses=still, rectified=rectify(still, "geometric"))).kinematics
    )


def lifted(facing_camera, sd: float, rows: int = 90, missing: slice = slice(0)) -> Take:
    """A person whose right wrist swings once a second by 0.2 across the view, of a lifter that says it errs by sd."""
    time_s = np.arange(rows) / 30
    joints = np.tile(facing_camera, (rows, 1, 1))
    joints[:, H36M17.index("r_wrist"), 0] += 0.2 * np.sin(2 * np.pi * time_s)
    joints[missing, H36M17.index("r_wrist")] = np.nan
    covariance = np.broadcast_to(sd**2 * np.diag([1, 1, 9]), (rows, 17, 3, 3))
    poses = PoseSequence(joints, H36M17, CAMERA, time_s=time_s, covariance=covariance, made_by=JUDGED)
    return Take("t", poses=poses)


def kinematics(take: Take, **options) -> dict[str, np.ndarray]:
    assert take.poses is not None
    return Trajectories(**options)(take.with_(rectified=rectify(take.poses, "geometric"))).kinematics or {}


def test_paths_have_errors_by_default_and_a_classical_filter_has_none(facing_camera):
    take = lifted(facing_camera, 0.01)
    found = kinematics(take)
    for prefix in ("", "v", "a"):
        for axis in "xyz":
            assert (found[f"r_wrist_{prefix}{axis}_sd"] > 0).all()
    # LEVEL's x is the depth, of which less is known.
    assert np.median(found["r_wrist_x_sd"] / found["r_wrist_y_sd"]) > 1.5
    missing = found.keys() ^ kinematics(take, cutoff_hz=3.0).keys()
    assert missing == {name for name in found if name.endswith(("_sd", "_reason"))}
    assert unit_of("r_wrist_ax_sd", "m") == "m/s2"
    assert unit_of("r_wrist_distance_sd", "m") == "m"


def test_a_run_says_why_its_paths_have_no_errors(facing_camera):
    def run(poses: PoseSequence) -> Take:
        return Take("t", poses=poses, rectified=rectify(poses, "geometric"))

    poses = lifted(facing_camera, 0.01).need("poses")
    take, unstated = run(poses), run(poses.with_(covariance=None))
    unchecked = run(poses.with_(made_by=replace(poses.made_by, by="somebody's")))
    for each, why in (
        (take, None),
        (unchecked, "were not checked"),
        (unstated, "were estimated from the paths"),
    ):
        said = [each for each in Trajectories()(each).notices if each.code == "errors-unknown"]
        assert len(said) == (why is not None)
        assert why is None or why in said[0].text
        assert not Trajectories(cutoff_hz=6.0)(each).notices
    for each, errors in ((take, "stated"), (unstated, "estimated")):
        by_error, classical = (
            Trajectories(cutoff_hz=hz)(each).need("filtered").history for hz in (None, 6.0)
        )
        assert by_error[-1].options["joint_errors"] == errors
        assert classical[-1].name == "low-pass filter"


def test_a_swing_is_told_and_what_does_not_move_is_not(facing_camera):
    found = kinematics(lifted(facing_camera, 0.01))
    assert (found["r_wrist_acceleration_reason"] == FINE).mean() > 0.9
    assert (found["l_ankle_acceleration_reason"] == UNCERTAIN).mean() > 0.9
    assert np.isfinite(found["l_ankle_acceleration"]).all()


def test_a_gap_is_bridged_as_far_as_the_error_lets_it(facing_camera):
    short = kinematics(lifted(facing_camera, 0.01, missing=slice(40, 44)))
    assert np.isfinite(short["r_wrist_x"]).all()
    for column, times in (("y_sd", 1.0), ("ay_sd", 1.15)):
        assert short[f"r_wrist_{column}"][42] > times * short[f"r_wrist_{column}"][20]
    long = kinematics(lifted(facing_camera, 0.01, missing=slice(30, 75)))
    assert (long["r_wrist_acceleration_reason"][50:56] == MISSING).all()
    assert np.isnan(long["r_wrist_ax"][50:56]).all()
    assert np.isfinite(long["l_wrist_x"]).all()


def test_nothing_has_bars_without_a_stated_error_that_somebody_has_judged(facing_camera):
    # A lifter that smooths or lags does not shake: two thirds of simulated ones were inside such bars.
    lift = lifted(facing_camera, 0.01).need("poses")
    judged = kinematics(Take("t", poses=lift))
    stranger = lift.with_(made_by=MadeBy("estimated", "somebody"))
    for poses in (stranger, lift.with_(covariance=None), walker(turn_deg=0.0).poses):
        found = kinematics(Take("t", poses=poses))
        for name in ("x", "vx", "speed", "ax", "acceleration"):
            assert np.isnan(found[f"r_wrist_{name}_sd"]).all()
            assert np.isfinite(found[f"r_wrist_{name}"]).all()
            assert np.isfinite(judged[f"r_wrist_{name}_sd"]).all()
        if poses is stranger:
            np.testing.assert_array_equal(found["r_wrist_x"], judged["r_wrist_x"])
