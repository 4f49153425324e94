"""Finished takes: what a run leaves, beside a truth that knows it; by the built-in lifter, by simulated ones, and by a
user's own, whose answers are files."""

import json
from pathlib import Path

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.angle_error.joint_noise import read_noise
from pcnet3d.models.common.metrics import scaled
from pcnet3d.models.lab.evaluation import errors as report
from pcnet3d.models.lab.evaluation import runs, testbed
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lab.evaluation.figures import figures
from pcnet3d.models.lab.evaluation.real_data import LIMBS, RealCamera, RealTruth
from pcnet3d.models.lab.evaluation.runs import KINDS, Configuration, Simulated, at_rate, finished
from pcnet3d.models.lab.evaluation.statements import statements
from pcnet3d.models.lab.evaluation.testbed import Answers
from pcnet3d.models.lifter.builtin import lift
from pcnet3d.pipeline import H36M17, PoseSequence, angle_deg
from pcnet3d.pipeline.core.frames import IMAGE
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.signals.angles import ANGLES
from refusals import refused


@pytest.fixture
def clip(monkeypatch):
    clip = walked(seconds=3)
    for module in (runs, testbed):
        monkeypatch.setattr(module, "read_clips", lambda subjects: (clip,))
    return clip


def tilt(one):
    up = one.take.rectified.R_source_from_level[..., 2]
    return angle_deg(*np.broadcast_arrays(up, one.truth.up))


@pytest.mark.parametrize(
    ("configuration", "most_deg"),
    [
        (Configuration(up_told=True, bed="typical"), 1.0),
        (Configuration(image=True, camera="moving", fps=60.0, bed="typical"), 2.0),
        (Configuration(lifter="", image=True, bed="typical"), 2.0),
    ],
)
def test_a_take_is_finished_and_its_truth_is_that_of_its_frames(clip, configuration, most_deg):
    takes = list(finished(runs.Question(people="test"), configuration))
    assert [(one.label, one.truth.subject, one.truth.clip) for one in takes] == [
        ("CMU test", "03", "03_01"),
        ("HDM05", "03", "03_01"),
    ]
    one = takes[0]
    assert one.take.poses.fps == pytest.approx(configuration.fps)
    assert len(one.take.poses) == len(one.truth.truth)
    assert one.truth.up.shape == ((3,) if configuration.camera == "static" else (len(one.truth.truth), 3))
    assert tilt(one).mean() < most_deg
    assert np.isfinite(one.take.kinematics["r_knee_flexion_deg"]).any()


def test_another_rate_goes_through_the_captured_joints(clip):
    twice = at_rate(clip, 60.0)
    assert len(twice) == 2 * len(clip) - 1
    np.testing.assert_allclose(twice.joints[::2], clip.joints, atol=1e-5)
    assert at_rate(clip, clip.fps) is clip


def test_the_real_take_is_known_by_its_limbs_and_seen_by_the_keypoints_that_a_run_finds(clip, monkeypatch):
    limbs = clip.joints[:, H36M17.indices(LIMBS)].astype(np.float64)
    R = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    centre = limbs.mean(axis=(0, 1))
    focal, middle = np.full(2, 1500.0), np.array([960.0, 540.0])
    camera = RealCamera(
        Path("cam.mp4"), R[:, 2], focal, middle, np.zeros(4), R, np.array([0, 0, 9.0]) - R @ centre
    )
    time_s = np.arange(len(limbs)) / clip.fps
    seen = np.zeros((len(limbs), len(COCO17), 2))
    seen[:] = camera.project(limbs).mean(axis=1, keepdims=True)
    seen[:, COCO17.indices(LIMBS)] = camera.project(limbs)
    keypoints = PoseSequence(seen, COCO17, IMAGE, np.ones(seen.shape[:2]), time_s, np.arange(len(limbs)))
    monkeypatch.setattr(runs, "read_moving", lambda: ({"cam": camera}, RealTruth(limbs, {})))
    monkeypatch.setattr(runs, "read_video", lambda path: Video(path, 1920, 1080, time_s, "h264"))
    monkeypatch.setattr(runs, "found_keypoints", lambda video: keypoints)
    (one,) = finished(runs.Question(), Configuration(real=True, focal_known=True))
    assert (one.label, one.truth.subject, one.reason) == ("real take", "real take", "")
    hips = one.truth.joints_camera[:, H36M17.indices(("r_hip", "l_hip"))]
    np.testing.assert_allclose(camera.to_camera(limbs)[:, [LIMBS.index("r_hip"), LIMBS.index("l_hip")]], hips)
    np.testing.assert_allclose(one.truth.joints_camera[:, 0], hips.mean(axis=1))
    assert np.isnan(one.truth.truth[:, H36M17.index("head")]).all()
    assert np.median(np.linalg.norm(one.take.poses.root - one.truth.joints_camera[:, 0], axis=1)) < 1.0
    stated = {stated.statement for stated in (*statements(one), *figures(one)) if len(stated.error)}
    assert {"up", "knee_flexion", "pelvis along the ray, m", "pelvis from frame to frame, m"} <= stated
    assert "joints" not in stated  # of which nobody knows all


@pytest.fixture
def folder(clip, tmp_path):
    """The answers of somebody's lifter, which has the truth at another scale and noise."""
    testbed.write_takes("val", tmp_path / "keypoints", seed=3, keypoints=True)
    (path,) = (tmp_path / "keypoints").iterdir()
    with np.load(path) as given:
        assert given["keypoints"].shape == (90, 17, 2)
        assert given["confidence"].shape == (90, 17)
        assert given["fps"] == 30
    truth = testbed.see(clip, 3).truth
    answers = tmp_path / "mine"
    answers.mkdir()
    noise = np.random.default_rng(0).normal(size=truth.shape)
    np.save(answers / f"{path.stem}.npy", 0.7 * truth + 0.01 * noise)
    return answers


def test_every_simulated_lifter_errs_in_its_own_way(clip):
    truth = testbed.see(clip, 0)
    own = lift(truth.keypoints, truth.image_size).joints
    answers = {kind: Simulated((kind,)).poses(truth, "wild", 0) for kind in KINDS}
    assert len({poses.made_by for poses in answers.values()}) == len(KINDS)
    for kind, poses in answers.items():
        assert poses.made_by == MadeBy("estimated", f"simulated ({kind})")
        np.testing.assert_allclose(poses.joint("pelvis"), 0, atol=1e-6)
        np.testing.assert_array_equal(poses.joints, Simulated((kind,)).poses(truth, "wild", 0).joints)
        assert np.linalg.norm(poses.joints - own, axis=-1).mean() > 0.005, kind
    depth = [np.abs(answers[kind].joints[..., 2]).mean() for kind in ("squeezed", "lagged")]
    assert depth[0] < 0.95 * depth[1]


def test_a_users_answers_are_the_poses_of_a_run(clip, folder):
    question = runs.Question(people="tennis", seed=3)
    (one,) = finished(question, Configuration(foreign=Answers(folder)))
    assert one.take.poses.made_by == MadeBy("estimated", "mine")
    assert one.take.angle_errors == "disagreement"
    off = scaled(one.take.poses.joints, one.truth.truth, "take") - one.truth.truth
    assert np.linalg.norm(off, axis=-1).mean() < 0.05


def test_answers_to_other_takes_are_refused(clip, folder):
    with refused("cannot-open"):
        Answers(folder).beds(seed=4)
    with refused("cannot-open"):
        Answers(folder).poses(testbed.see(clip, 3), "typical", 3)
    (path,) = folder.iterdir()
    np.save(path, np.load(path)[:50])
    with refused("files-apart"):
        Answers(folder).poses(testbed.see(clip, 3), "wild", 3)


def test_errors_are_fitted_to_a_users_answers_and_judged_with_the_file(clip, folder, tmp_path, monkeypatch):
    monkeypatch.setattr(
        report, "ANGLES", {name: ANGLES[name] for name in ("r_knee_flexion", "l_knee_flexion")}
    )
    asked = {"sets": "tennis", "because": "a test", "seed": 3, "answers": folder, "part": ["mine, wild"]}
    evaluate("errors", tmp_path / "fitted", fit=True, **asked)
    path = tmp_path / "fitted" / "joint_noise.json"
    assert read_noise(path).lifter == "mine"
    evaluate("errors", tmp_path / "judged", errors=path, **asked)
    rows = json.loads((tmp_path / "judged" / "errors.json").read_text())
    (knee,) = [row for row in rows if row["statement"] == "knee_flexion"]
    assert knee["configuration"] == "mine, wild"
    assert knee["inside"] == pytest.approx(0.9, abs=0.05)


def test_answers_become_takes_to_train_on(clip, folder, tmp_path):
    testbed.write_takes("val", tmp_path / "takes.npz", seed=3, answers=folder)
    with np.load(tmp_path / "takes.npz") as file:
        (answer,) = folder.iterdir()
        np.testing.assert_allclose(file["lifted"], np.load(answer) - np.load(answer)[:, :1], atol=1e-6)
        np.testing.assert_allclose(file["truth"], testbed.see(clip, 3).truth, atol=1e-6)
