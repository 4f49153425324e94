"""3D joints in JSON of whoever wrote it: OpenPose's reconstruction, EasyMocap, Azure Kinect, ZED (formats.md 5)."""

import json

import numpy as np
import pytest

from golden.bodies import hips_of, placed, standing, turning
from golden.estimators import azure_kinect, easymocap3d
from golden.lifters import openpose3d
from pcnet3d.adapters import json3d, read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.layouts import BODY_25, OPENPOSE18
from pcnet3d.pipeline.reading.load import adapters
from refusals import refused

FRAMES = 40
AWAY_M = np.array([0.3, 0.1, 4.0])


@pytest.fixture
def save(tmp_path):
    """save(frames): each frame's people, (J, 3) each; a joint of NaN was not found."""
    return lambda frames, name="pose_keypoints_3d": openpose3d(tmp_path, frames, name)


@pytest.fixture
def alone() -> list[list[np.ndarray]]:
    return [[body] for body in placed(turning(FRAMES) + AWAY_M, BODY_25.joints)]


def test_other_joints_under_another_name_after_a_frame_of_nobody(save):
    frames = [[body] for body in placed(turning(FRAMES) + AWAY_M, OPENPOSE18.joints)]
    folder = save([[], *frames], "body_keypoints_3d")
    fits = [name for name, each in adapters().items() if each.sniff(folder)]
    assert fits == ["json2d", "json3d"]  # its 2D results are there too; 3D comes first
    poses = read(folder, fps=30)
    bodies = turning(FRAMES) - hips_of(turning(FRAMES))
    for joint in ("r_hip", "l_ankle", "r_wrist", "l_shoulder", "nose"):
        np.testing.assert_allclose(poses.joint(joint), bodies[:, H36M17.index(joint)], atol=1e-6)
    np.testing.assert_array_equal(poses.frame_index, np.arange(1, FRAMES + 1))
    assert np.isnan(poses.confidence).all()  # 1 for each that was found says nothing


def test_unit(save, alone):
    folder = save([[1000 * body] for (body,) in alone])
    poses = read(folder, unit="mm")
    np.testing.assert_allclose(poses.joint("r_knee"), turning(FRAMES)[:, H36M17.index("r_knee")], atol=1e-5)
    with pytest.raises(InputError, match="Expected a unit of"):
        read(folder, unit="feet")


def test_people_whose_order_changes(save, alone):
    other = [body + np.array([2.0, 0, 0]) for (body,) in alone]
    frames = [
        [body, two] if i % 3 else [two, body]
        for i, ((body,), two) in enumerate(zip(alone, other, strict=True))
    ]
    first, second = read_all(save(frames))
    np.testing.assert_allclose(first.joints, second.joints, atol=1e-5)
    (step,) = [step for step in first.history if step.name == "link people"]
    assert step.options == {"method": "nearest position"}


def test_two_who_are_never_seen_together_are_doubted(save, alone):
    frames = [[body + (np.array([3.0, 0, 0]) if i >= 20 else 0)] for i, (body,) in enumerate(alone)]
    (poses,) = read_all(save(frames))
    (said,) = poses.notices
    assert (said.code, said.values["frame"]) == ("leap-between-people", 20)


def test_the_layout_is_that_of_all_bodies(save, alone):
    """Of the first body only neck, nose and elbow are in view, whose bones are none of either layout's."""
    seen = BODY_25.indices(["neck", "nose", "r_elbow"])
    alone[0][0][np.setdiff1d(np.arange(25), seen)] = np.nan
    (poses,) = json3d.read(save(alone))
    assert poses.layout == BODY_25


def test_2d_results_only(save, alone):
    folder = save([[np.empty((0, 3))] for _ in alone])
    assert not json3d.sniff(folder)
    with pytest.raises(InputError, match="adapter json2d reads OpenPose's 2D results"):
        read(folder, "json3d")


def test_a_joint_that_was_not_found_is_missing(tmp_path):
    missing = np.isnan(read(easymocap3d(tmp_path, standing(FRAMES))).joints).any(axis=-1)
    assert np.argwhere(missing).tolist() == [[7, H36M17.index("l_wrist")]]


def test_a_row_without_a_pose_is_a_gap_and_counted(tmp_path):
    path = azure_kinect(tmp_path, [turning(FRAMES)])
    content = json.loads(path.read_text(encoding="utf-8"))
    for frame in content["frames"]:
        del frame["bodies"][0]["body_id"]
    body = content["frames"][9]["bodies"][0]
    body["joint_positions"] = [[None] * 3 for _ in body["joint_positions"]]
    path.write_text(json.dumps(content), encoding="utf-8")
    poses = read(path)
    assert len(poses) == FRAMES
    assert "frames-as-gaps" in [each.code for each in poses.notices]


def test_axes_and_unit_that_are_told_and_numbers_of_joints_that_nobody_has(tmp_path):
    path = azure_kinect(tmp_path, [turning(FRAMES)])
    assert read(path, unit="cm").joints[0, 5, 1] == pytest.approx(10 * read(path).joints[0, 5, 1])
    content = json.loads(path.read_text(encoding="utf-8"))
    for frame in content["frames"]:
        frame["bodies"][0]["joint_positions"].pop()
    path.write_text(json.dumps(content), encoding="utf-8")
    with refused("wrong-content"):
        read(path, "json3d")
