"""Other lifters' poses of the test bed: simulated ones, and a user's own as files, judged and fitted."""

import json

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.angle_error.joint_noise import read_noise
from pcnet3d.models.common.metrics import scaled
from pcnet3d.models.lab.errors import report
from pcnet3d.models.lab.evaluation import sets
from pcnet3d.models.lab.evaluation import testbed as module
from pcnet3d.models.lab.evaluation import write_takes as writing
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lab.evaluation.finished import Configuration, finished
from pcnet3d.models.lab.evaluation.foreign import KINDS, Answers, Simulated
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.lab.evaluation.write_takes import write_takes
from pcnet3d.models.lifter.builtin import lift
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.signals.angles import ANGLES
from refusals import refused


@pytest.fixture
def clip(monkeypatch):
    clip = walked(seconds=3)
    monkeypatch.setattr(sets, "read_clips", lambda subjects: (clip,))
    monkeypatch.setattr(module, "read_clips", lambda subjects: (clip,))
    monkeypatch.setattr(writing, "read_clips", lambda subjects: (clip,))
    return clip


@pytest.fixture
def folder(clip, tmp_path):
    """The answers of somebody's lifter, which has the truth at another scale and noise."""
    write_takes("val", tmp_path / "keypoints", seed=3, keypoints=True)
    (path,) = (tmp_path / "keypoints").iterdir()
    with np.load(path) as given:
        assert given["keypoints"].shape == (90, 17, 2)
        assert given["confidence"].shape == (90, 17)
        assert given["fps"] == 30
    truth = see(clip, 3).truth
    answers = tmp_path / "mine"
    answers.mkdir()
    noise = np.random.default_rng(0).normal(size=truth.shape)
    np.save(answers / f"{path.stem}.npy", 0.7 * truth + 0.01 * noise)
    return answers


def test_every_simulated_lifter_errs_in_its_own_way(clip):
    truth = see(clip, 0)
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
    question = sets.Question(people="tennis", seed=3)
    (one,) = finished(question, Configuration(foreign=Answers(folder)))
    assert one.take.poses.made_by == MadeBy("estimated", "mine")
    assert one.take.angle_errors == "disagreement"
    off = scaled(one.take.poses.joints, one.truth.truth, "take") - one.truth.truth
    assert np.linalg.norm(off, axis=-1).mean() < 0.05


def test_answers_to_other_takes_are_refused(clip, folder):
    with refused("cannot-open"):
        Answers(folder).beds(seed=4)
    with refused("cannot-open"):
        Answers(folder).poses(see(clip, 3), "typical", 3)
    (path,) = folder.iterdir()
    np.save(path, np.load(path)[:50])
    with refused("files-apart"):
        Answers(folder).poses(see(clip, 3), "wild", 3)


def test_keypoints_go_with_nothing_that_makes_other_takes(tmp_path):
    with refused("option-conflict"):
        write_takes("val", tmp_path / "keypoints", keypoints=True, bodies=True)


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
    write_takes("val", tmp_path / "takes.npz", seed=3, answers=folder)
    with np.load(tmp_path / "takes.npz") as file:
        (answer,) = folder.iterdir()
        np.testing.assert_allclose(file["lifted"], np.load(answer) - np.load(answer)[:, :1], atol=1e-6)
        np.testing.assert_allclose(file["truth"], see(clip, 3).truth, atol=1e-6)
