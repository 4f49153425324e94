"""A real take with truth: cameras that see where they should, and errors that are the ones put in."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab.evaluation import real_take as module
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lab.evaluation.real_data import (
    LIMBS,
    RealCamera,
    exact_keypoints,
    openpose_keypoints,
    read_cameras,
    read_truth,
    triangulated,
)
from pcnet3d.models.lab.evaluation.real_take import level_row, lift_row, truth_row
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.rotations import rotate
from refusals import refused

_ROWS = H36M17.indices(LIMBS)
_TIME_S = np.arange(60) / 60
_R_CAMERA_FROM_WORLD = Rotation.from_euler("zx", [40, 110], degrees=True).as_matrix()
_UP = _R_CAMERA_FROM_WORLD[:, 2]
_TILT = Rotation.from_rotvec(
    np.radians(10) * np.cross(_UP, [0, 0, 1]) / np.linalg.norm(np.cross(_UP, [0, 0, 1]))
)


@pytest.fixture
def world(facing_camera) -> np.ndarray:
    """(60, 17, 3) metres, +Z up: someone who stands, and lifts both arms sideways without bending a limb."""
    joints = np.tile(facing_camera @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (60, 1, 1)).astype(float)
    for side, sign in (("l", 1), ("r", -1)):
        at = {part: H36M17.index(f"{side}_{part}") for part in ("shoulder", "elbow", "wrist")}
        for part in ("elbow", "wrist"):
            arm = joints[:, at[part]] - joints[:, at["shoulder"]]
            turn = Rotation.from_rotvec(sign * np.linspace(0, -1, 60)[:, None] * np.array([0.0, 1.0, 0.0]))
            joints[:, at[part]] = joints[:, at["shoulder"]] + turn.apply(arm)
    return joints


@pytest.fixture
def poses(world) -> PoseSequence:
    """A perfect lift of that person, at another scale."""
    return PoseSequence(
        0.6 * rotate(_R_CAMERA_FROM_WORLD, world), H36M17, CAMERA, None, _TIME_S, np.arange(60)
    )


def knows_up(R_extra: np.ndarray) -> SimpleNamespace:
    """A rectifier that is told up, turned by R_extra."""

    def rotation(joints):
        return body_axes(joints, R_extra @ _UP), np.full(len(joints), 2.0)

    return SimpleNamespace(method="told", rotation=rotation)


def camera_of(R: np.ndarray, distortion: np.ndarray) -> RealCamera:
    """Four metres from the world's origin."""
    lens = np.full(2, 1000.0), np.full(2, 500.0), distortion
    return RealCamera("", R[:, 2], *lens, R, np.array([0.0, 0, 4]))


def test_a_barrel_lens_draws_points_towards_its_centre_by_the_first_coefficient():
    lens = np.array([1000.0, 900.0]), np.array([500.0, 400.0]), np.array([-0.2, 0, 0, 0])
    camera = RealCamera("", np.array([0, -1, 0]), *lens, np.eye(3), np.array([0.0, 0.0, 2.0]))
    drawn_in = 1 - 0.2 * 0.5**2  # of a ray half as far aside as away
    points = np.tile(np.array([0.6, -0.8, 0.0]), (2, 3, 1))
    seen = camera.project(points)
    np.testing.assert_allclose(seen, np.tile([500 + 300 * drawn_in, 400 - 360 * drawn_in], (2, 3, 1)))


def test_a_perfect_lift_has_no_error(poses, world):
    limbs = world[:, _ROWS]
    lift, level = lift_row(poses, limbs), level_row(knows_up(np.eye(3)), poses, _UP, limbs)
    assert max(lift["pa_mm"], lift["rigid_mm"]) < 1e-3
    assert level["up_deg"] < 1e-3
    assert level["levelled"] == 1
    for row, names in ((lift, ("knee_flexion", "elbow_flexion")), (level, ("trunk_lean_sagittal",))):
        for name in names:
            assert row[name]["rmse"] < 0.01


def test_a_wrong_up_costs_lean_only(poses, world):
    limbs = world[:, _ROWS]
    row = level_row(knows_up(_TILT.as_matrix()), poses, _UP, limbs)
    assert row["up_deg"] == pytest.approx(10, abs=1)  # the feet vote too
    lean = np.hypot(row["trunk_lean_sagittal"]["rmse"], row["trunk_lean_frontal"]["rmse"])
    assert lean == pytest.approx(row["up_deg"], abs=0.3)
    assert lift_row(poses, limbs)["rigid_mm"] < 1e-3


def test_a_bent_knee_shows_in_the_knee_only(poses, world):
    knee, ankle = H36M17.indices(("l_knee", "l_ankle"))
    before = lift_row(poses, world[:, _ROWS])
    side = world[0, H36M17.index("r_hip")] - world[0, H36M17.index("l_hip")]
    side /= np.linalg.norm(side)
    bent = world.copy()
    bent[:, ankle] = bent[:, knee] + Rotation.from_rotvec(np.radians(20) * side).apply(
        bent[:, ankle] - bent[:, knee]
    )
    after = lift_row(poses, bent[:, _ROWS])
    assert before["knee_flexion"]["mae"] < 0.01
    assert after["knee_flexion"]["mae"] == pytest.approx(10, abs=1)  # 20 degrees at one knee of two
    assert after["elbow_flexion"]["mae"] < 0.01
    assert min(after["rigid_mm"], after["pa_mm"]) > 1


def test_exact_keypoints_keep_the_face_and_a_score_of_0_is_missing(world):
    found = np.random.default_rng(0).uniform(100, 500, (60, 17, 3))
    found[..., 2] = 0.5
    found[3, COCO17.index("nose"), 2] = 0
    camera = camera_of(_R_CAMERA_FROM_WORLD, np.zeros(4))
    given = openpose_keypoints(found, _TIME_S)
    assert np.isnan(given.joints[3, COCO17.index("nose")]).all()
    exact = exact_keypoints(camera, world[:, _ROWS], given)
    np.testing.assert_array_equal(
        exact.joints[:, COCO17.index("l_eye")], given.joints[:, COCO17.index("l_eye")]
    )
    wrist = H36M17.index("l_wrist")
    np.testing.assert_allclose(
        exact.joints[:, COCO17.index("l_wrist")], camera.project(world[:, wrist]), rtol=1e-5
    )


@pytest.mark.parametrize(
    "content", [None, "{", '{"cameras": {"cam01": {"focal_px": [1, 1]}}}', '{"cameras": 3}']
)
def test_cameras_that_say_too_little_are_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "cameras.json").write_text(content)
    with refused("file-damaged"):
        read_cameras(tmp_path)


def test_keypoints_of_several_cameras_meet_in_the_joints(world):
    """A joint that only one camera found is not known; another that one of them missed is."""
    limbs, cameras, seen = world[:, _ROWS], {}, {}
    for name, turn in (("one", 0), ("two", 70), ("three", 150)):
        R = _R_CAMERA_FROM_WORLD @ Rotation.from_euler("z", turn, degrees=True).as_matrix()
        cameras[name] = camera_of(R, np.array([-0.1, 0.02, 0, 0]))
        seen[name] = np.ones((len(limbs), len(COCO17), 3))
        seen[name][:, COCO17.indices(LIMBS), :2] = cameras[name].project(limbs)
    seen["one"][:, COCO17.index("l_knee"), 2] = 0
    np.testing.assert_allclose(triangulated(cameras, seen), limbs, atol=1e-3)
    seen["two"][:, COCO17.index("l_knee"), 2] = 0
    assert np.isnan(triangulated(cameras, seen)[:, LIMBS.index("l_knee")]).all()


def test_two_truths_are_as_far_apart_as_what_was_moved(world):
    limbs = world[:, _ROWS]
    moved = limbs.copy()
    moved[:, LIMBS.index("r_wrist")] += [0.0, 0.0, 0.05]
    row = truth_row(moved, limbs, _TIME_S)
    assert row["r_wrist"] == pytest.approx(50)
    assert row["l_wrist"] == row["r_hip"] == pytest.approx(0, abs=1e-6)
    assert row["knee_flexion"] == pytest.approx(0, abs=1e-3)
    turned = rotate(Rotation.from_euler("z", 12, degrees=True).as_matrix(), limbs)
    assert truth_row(turned, limbs, _TIME_S)["BODY's heading"] == pytest.approx(12, abs=1e-6)


@pytest.mark.data("real")
def test_the_cameras_see_the_truth_where_openpose_does(data):
    folder = data / "real" / "pose2sim"
    cameras = read_cameras(folder)
    truth = read_truth(folder, list(cameras))
    rows = COCO17.indices(LIMBS)
    for name, camera in cameras.items():
        off = np.linalg.norm(camera.project(truth.limbs) - truth.openpose[name][:, rows, :2], axis=-1)
        assert np.median(off) < 30, name  # pixels of 1920; 22 in cam03
        np.testing.assert_allclose(camera.R_camera_from_world[:, 2], camera.up, atol=1e-6)


@pytest.mark.data("real")
def test_the_whole_report(data, tmp_path, monkeypatch, capsys):
    """OpenPose's keypoints stand in for those that the detector needs half a minute to find."""
    truth = read_truth(data / "real" / "pose2sim", ["cam01"])

    def found(video):
        return openpose_keypoints(truth.openpose["cam01"][: len(video.time_s)], video.time_s)

    monkeypatch.setattr(module, "found_keypoints", found)
    evaluate("real-take", tmp_path / "out", rectifier=["pcnet"])
    results = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    assert list(results["lift"]["OpenPose"]) == ["cam01", "cam02", "cam03", "cam04", "mean"]
    assert 20 < results["lift"]["exact limbs"]["mean"]["pa_mm"] < 100
    method, with_image = results["standing"]
    assert with_image == f"{method}, with the image"
    # Of the image, whoever the keypoints are of, as long as these do not seem to stand upright before a usual camera.
    off = [results["standing"][with_image][name]["up_deg"] for name in ("cam01", "cam02", "cam03")]
    assert max(off) < 1.5
    assert 0 < results["level"][f"OpenPose, {method}"]["mean"]["up_deg"] < 30
    assert "| OpenPose | cam01 |" in capsys.readouterr().out
