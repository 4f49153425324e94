"""The adapter on a golden file, the stage, the writer and the lifter on motion whose truth is known."""

import json

import numpy as np
import pytest
from pcnet3d_acme.acme import HEADER
from pcnet3d_acme.paths import write
from pcnet3d_acme.reach import Reach, reach

from pcnet3d.adapters import read
from pcnet3d.examples.walker import camera_poses, side_camera, walker
from pcnet3d.models import load_lifter
from pcnet3d.pipeline import (
    CAMERA,
    H36M17,
    IMAGE,
    InputError,
    PoseSequence,
    Take,
    ToLift,
    check_adapter,
    rotate,
)
from pcnet3d.stages import rectify


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=4)


@pytest.fixture
def golden(walk, tmp_path):
    """poses.csv as Acme exports it: y up, z towards the camera, millimetres, a camera 3 m away."""
    joints = camera_poses(walk, side_camera(walk)).joints + np.array([0.2, 0, 3])
    rows = np.column_stack([walk.time_s, (1000 * joints * [1, -1, -1]).reshape(len(walk), -1)])
    lines = [",".join(HEADER), *(",".join(f"{value:.4f}" for value in row) for row in rows)]
    path = tmp_path / "poses.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_adapter_keeps_its_promises(golden):
    (person,) = check_adapter("acme", golden)
    assert (person.frame.axes, person.frame.unit) == (("right", "up", "toward"), "mm")
    assert person.time_s is not None


def test_what_was_written_comes_back(golden, walk):
    poses = read(golden)
    np.testing.assert_allclose(poses.joints, camera_poses(walk, side_camera(walk)).joints, atol=1e-5)
    np.testing.assert_allclose(poses.times, walk.time_s, atol=1e-4)
    assert (poses.frame.axes, poses.frame.unit) == (CAMERA.axes, "m")


def test_an_empty_cell_is_missing(golden):
    text = golden.read_text(encoding="utf-8").splitlines()
    cells = text[3].split(",")
    cells[HEADER.index("r_wrist_x")] = ""
    golden.write_text("\n".join([*text[:3], ",".join(cells), *text[4:]]), encoding="utf-8")
    missing = np.isnan(read(golden).joint("r_wrist")).any(axis=1)
    assert np.flatnonzero(missing).tolist() == [2]


@pytest.mark.parametrize(
    "damage", [lambda text: text[:-100], lambda text: text.replace("0.0000", "start", 1)]
)
def test_damage_has_words(golden, damage):
    golden.write_text(damage(golden.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(InputError, match=r"poses\.csv: expected 52 numbers"):
        read(golden)


def test_reach_of_an_arm_that_is_stretched_out():
    joints = np.zeros((3, 17, 3))
    joints[:, H36M17.index("r_wrist")] = [0.3, 0.4, 0.0]
    joints[2, H36M17.index("r_wrist")] = np.nan
    np.testing.assert_allclose(reach(PoseSequence(joints, H36M17, CAMERA), "r"), [0.5, 0.5, np.nan])


def test_a_side_that_nobody_has():
    with pytest.raises(InputError, match="side l, r or both, got 'left'"):
        Reach("left")


def test_paths_are_those_of_level(walk, tmp_path):
    poses = camera_poses(walk, side_camera(walk))
    joints = poses.joints.copy()
    joints[2, H36M17.index("r_wrist")] = np.nan
    rectified = rectify(poses.with_(joints=joints), rectifier="geometric")
    write(Take("walk", rectified=rectified), tmp_path / "paths.json")
    content = json.loads((tmp_path / "paths.json").read_text(encoding="utf-8"))
    assert content["paths"]["r_wrist"][2] is None
    np.testing.assert_allclose(content["paths"]["l_knee"], rectified.level.joint("l_knee"))
    np.testing.assert_allclose(content["time_s"], walk.time_s)


@pytest.fixture
def flat():
    """(250, 17, 3) a figure of cardboard that sways 4 m away from the camera."""
    body = np.random.default_rng(0).uniform(-0.8, 0.8, (17, 3)) * [1, 1, 0]
    body[H36M17.index("pelvis")] = 0
    sway = np.column_stack([np.sin(np.arange(250) / 20), np.zeros(250), np.zeros(250)])
    return body + sway[:, None] * 0.1 * [1, 0, 0] + [0, 0, 4]


def seen(joints, focal_px, **more):
    pixels = joints[..., :2] / joints[..., 2:] * focal_px + [320, 180]
    times = np.arange(len(joints)) / 30
    return ToLift(PoseSequence(pixels, H36M17, IMAGE, time_s=times), (640, 360), focal_px, **more)


@pytest.mark.parametrize("pitch_deg", [0, 20])
@pytest.mark.parametrize("focal_px", [500, 900])
def test_a_flat_figure_comes_back_by_the_focal_length_and_up(flat, pitch_deg, focal_px):
    tilt = np.radians(pitch_deg)
    c, s = np.cos(tilt), np.sin(tilt)
    R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    lifter = load_lifter("cardboard")
    turned = rotate(R, flat)
    lifted = lifter.lift(seen(turned, focal_px, up=R @ [0, -1, 0]))
    truth = turned - turned[:, :1]
    depth = turned[:, :1, 2:]
    np.testing.assert_allclose(lifted.poses.joints, truth / depth, atol=0.02)
    assert (lifted.focal_px, lifted.focal_known, lifted.up_known) == (focal_px, True, True)
    if pitch_deg:
        blind = lifter.lift(seen(turned, focal_px)).poses.joints
        assert np.abs(blind - truth / depth).max() > 0.05
