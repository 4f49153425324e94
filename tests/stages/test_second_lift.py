"""Two lifters of the same keypoints: where they disagree, and what a run says about it."""

import json

import numpy as np
import pytest

from golden import bodies
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, InputError, PoseSequence, Take, rotate
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.plan import planned
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.stages import rectify
from pcnet3d.stages.second_lift import SecondLift, disagreement

FPS = 30
ELBOW, WRIST = H36M17.index("r_elbow"), H36M17.index("r_wrist")


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=2)


@pytest.fixture(scope="module")
def poses(walk) -> PoseSequence:
    joints = camera_poses(walk, side_camera(walk)).joints
    joints = joints - joints[:, :1]
    frame = CAMERA.with_(origin="pelvis", unit="m")
    return PoseSequence(joints, H36M17, frame, time_s=np.arange(len(joints)) / FPS)


@pytest.fixture(scope="module")
def levelled(poses):
    return rectify(poses, "geometric")


def test_the_same_lift_at_another_size_does_not_disagree(poses, levelled):
    apart, found = disagreement(poses, poses.with_(joints=poses.joints * 0.4), levelled)
    np.testing.assert_allclose(apart, 0, atol=1e-4)
    assert found["spans_s"] == []
    assert max(of["rms_deg"] for of in found["angles"].values()) < 0.01


def test_joints_that_are_off_are_found_with_joint_angle_and_time(poses, levelled):
    """A forearm that is turned by 30 degrees about its elbow for a third of the take, and a body back to front."""
    joints = poses.joints.astype(np.float64)
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    joints[:20, WRIST] = joints[:20, ELBOW] + rotate(turn, joints[:20, WRIST] - joints[:20, ELBOW])
    joints[30:45] *= [1, 1, -1]
    joints[48] *= [1, 1, -1]
    apart, found = disagreement(poses, poses.with_(joints=joints), levelled)
    assert found["spans_s"] == pytest.approx(np.array([[30 / FPS, 48 / FPS]]))
    assert np.allclose(apart[20:30], apart[50], atol=0.1)  # but for the common size
    assert (apart[:20] > apart[50] + 0.5).all()
    moved = {name: of["apart_percent"].p50 for name, of in found["joints"].items()}
    assert max(moved, key=lambda name: moved[name]) == "r_wrist"


def test_one_factor_of_size_is_that_of_all_joints(poses, levelled):
    """A joint that is off by a known distance is reported in per cent of the person's size."""
    joints = poses.joints.astype(np.float64)
    off = np.zeros(3)
    off[0] = 0.01
    size = np.sqrt((np.delete(joints, 0, axis=1) ** 2).sum(axis=-1).mean())
    joints[:, WRIST] += off
    _, found = disagreement(poses, poses.with_(joints=joints), levelled)
    assert found["joints"]["r_wrist"]["apart_percent"].p50 == pytest.approx(1 / size, rel=0.05)
    assert found["joints"]["l_knee"]["apart_percent"].p50 < 0.1 / size


def test_rows_are_matched_by_frame_and_missing_joints_say_nothing(poses, levelled):
    joints = poses.joints[10:40].copy()
    joints[5, WRIST] = np.nan
    second = PoseSequence(joints, H36M17, poses.frame, frame_index=np.arange(10, 40))
    apart, found = disagreement(poses, second, levelled)
    expected = np.zeros(len(poses), dtype=bool)
    expected[10:40] = True
    expected[15] = False
    np.testing.assert_array_equal(np.isfinite(apart), expected)
    np.testing.assert_allclose(apart[expected], 0, atol=0.5)
    assert found["frames"] == 29


def test_of_half_a_body_the_joints_that_are_seen_are_compared(poses, levelled):
    joints = poses.joints.copy()
    joints[:, H36M17.index("l_ankle")] = np.nan
    half = poses.with_(joints=joints)
    apart, found = disagreement(half, poses, levelled)
    assert found["frames"] == len(poses)
    np.testing.assert_allclose(apart, 0, atol=0.5)
    assert found["joints"]["r_wrist"]["apart_percent"].p50 == pytest.approx(0, abs=0.5)


@pytest.fixture(scope="module")
def files(walk, tmp_path_factory):
    return write_files(tmp_path_factory.mktemp("walk"), walk, side_camera(walk))


@pytest.fixture(scope="module")
def still(tmp_path_factory) -> str:
    """A lifter that answers with one standing body, whatever the person does."""
    return answering(tmp_path_factory.mktemp("still") / "still.onnx", bodies.facing_camera())


def answering(path, body) -> str:
    onnx = pytest.importorskip("onnx")
    from onnx import TensorProto, helper, numpy_helper

    value = helper.make_tensor_value_info
    shapes = [value("x", TensorProto.FLOAT, [1, "t", 17, 3]), value("y", TensorProto.FLOAT, [1, "t", 17, 3])]
    weights = {"zero": np.zeros((3, 3)), "body": body}
    nodes = [
        helper.make_node("MatMul", ["x", "zero"], ["no"]),
        helper.make_node("Add", ["no", "body"], ["y"]),
    ]
    constants = [numpy_helper.from_array(w.astype(np.float32), name) for name, w in weights.items()]
    graph = helper.make_graph(nodes, "still", shapes[:1], shapes[1:], constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), path)
    return str(path)


def test_a_run_warns_shows_and_lists_where_the_two_disagree(files, still, tmp_path):
    options = RunOptions(video=files.video, keypoints=files.keypoints, also_lifter=still)
    recipe = planned(options)
    assert [entry.use for entry in recipe.stages][-5:] == [
        "second_lift",
        "measures",
        "record",
        "export",
        "report",
    ]
    take = run_files(options, tmp_path / "out", recipe.without("record"))
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["second_lift"]["lifter"].startswith("still.onnx@")
    assert summary["second_lift"]["spans_s"]
    (said,) = [each for each in summary["notices"] if each["code"] == "lifters-disagree"]
    assert said["values"]["lifter"].startswith("still.onnx@")
    assert (take.kinematics or {})["lifters_apart_percent"].shape == (len(take.need("poses")),)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Where two lifters disagree" in page
    assert "one errs by at least" in page


def test_a_second_lift_whose_left_and_right_are_wrong_is_compared_all_the_same(poses, levelled, tmp_path):
    """Nobody questions them there; but what is noted of them is its last step, and the lift was looked for in that."""
    mirrored = answering(tmp_path / "mirrored.onnx", bodies.facing_camera() * [-1, 1, 1])
    pixels = 200 + 100 * poses.joints[..., :2]
    keypoints = PoseSequence(pixels, H36M17, IMAGE, time_s=poses.times)
    take = Take("walk", keypoints=keypoints, poses=poses, rectified=levelled)
    found = SecondLift(mirrored)(take.telling(image_size=(400, 400))).second_lift
    assert found is not None
    assert found["lifter"].startswith("mirrored.onnx@")


def test_the_poses_of_a_file_get_a_second_opinion(files, tmp_path):
    options = RunOptions(
        poses=files.poses, video=files.video, keypoints=files.keypoints, also_lifter="pcnet3d"
    )
    recipe = planned(options).without("record").without("report").without("calibrate")
    take = run_files(options, tmp_path / "out", recipe)
    assert take.second_lift is not None
    assert take.second_lift["lifter"].startswith("pcnet3d@")
    assert 2 < take.second_lift["apart_percent"].p50 < 40
    assert not any(step.name == "lift" for step in take.need("poses").history)


def test_what_cannot_be_compared_is_refused(tmp_path, walk):
    lifted = tmp_path / "poses.npy"
    np.save(lifted, camera_poses(walk, side_camera(walk)).joints)
    options = RunOptions(poses=lifted, adapter="motionbert", fps=30, also_lifter="pcnet3d")
    with pytest.raises(InputError, match="'second_lift' needs keypoints"):
        run_files(options, tmp_path / "out", planned(options))
    with pytest.raises(InputError, match="no lifter 'pcnet3e'"):
        planned(options.with_(also_lifter="pcnet3e")).build()


def test_without_a_second_lifter_there_is_nothing_of_it(walk, tmp_path):
    lifted = tmp_path / "poses.npy"
    np.save(lifted, camera_poses(walk, side_camera(walk)).joints)
    options = RunOptions(poses=lifted, adapter="motionbert", fps=30)
    run_files(options, tmp_path / "out", planned(options).without("record"))
    assert "second_lift" not in json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "two lifters" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
