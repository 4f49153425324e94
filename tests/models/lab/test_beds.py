"""Takes whose truth is known: deterministic, and true to their camera; and what a run leaves of them."""

import json
from itertools import islice

import numpy as np
import pytest

from golden.bodies import facing_camera
from golden.virtual import walked
from pcnet3d.models.angle_error.joint_noise import read_noise
from pcnet3d.models.common.canonical import body_axes
from pcnet3d.models.lab import beds as module
from pcnet3d.models.lab.beds import Configuration, at_rate, finished, laid_down, see, write_takes
from pcnet3d.models.lab.clips import Clip, lying, trunk_lean_deg
from pcnet3d.models.lab.evaluation import errors as report
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lifter.features import body_rays
from pcnet3d.models.lifter.load import load_lifter
from pcnet3d.pipeline import H36M17, angle_deg
from pcnet3d.pipeline.signals.angles import ANGLES
from refusals import refused


def clip(name="09_01", frames=50):
    """Someone who walks half a metre without moving a limb."""
    pose = facing_camera()[:, [0, 2, 1]] * [1, 1, -1] + [0, 0, 0.9]
    way = np.linspace(0, 0.5, frames)[:, None, None] * np.array([0, -1, 0])
    return Clip(name, name[:2], "asfamc", 30.0, (pose + way).astype(np.float32))


def test_truth_fits_itself_and_another_seed_or_name_has_another_camera():
    take = see(clip(), 0)
    for other in (see(clip(), 1), see(clip("09_02"), 0)):
        assert not np.allclose(take.R_camera_from_world, other.R_camera_from_world)
    np.testing.assert_allclose(take.R_camera_from_body, body_axes(take.truth, take.up), atol=1e-9)
    np.testing.assert_allclose(take.R_camera_from_body[..., 2], np.broadcast_to(take.up, (50, 3)), atol=1e-9)
    np.testing.assert_array_equal(take.truth[:, 0], 0)
    centre = take.joints_camera[:, H36M17.indices(("pelvis", "thorax"))].mean(axis=1)
    along = np.einsum("tji,tj->ti", body_rays(take.joints_camera), centre)
    assert (np.abs(along[:, :2]) < 0.05 * along[:, 2:]).all()  # the body's centre lies on the ray
    leaning = np.random.default_rng(0).normal(size=(50, 17, 3))
    np.testing.assert_array_equal(lying(leaning), trunk_lean_deg(leaning) > 60)


def test_a_laid_body_lies_and_moves_as_before():
    upright = clip()
    for seed in range(3):
        laid = laid_down(upright, seed, 1.0)
        apart = [
            np.linalg.norm(np.diff(one.joints[:, [0, 5, 9]], axis=1), axis=-1) for one in (upright, laid)
        ]
        np.testing.assert_allclose(*apart, atol=1e-5)
        assert (np.abs(trunk_lean_deg(laid.joints) - 90) < 40).all()
        assert abs(np.quantile(laid.joints[..., 2], 0.05)) < 1e-5
    assert laid_down(upright, 0, 0.0) is None


def test_the_command_writes_plain_arrays_and_none_by_a_lifter_that_saw_the_subjects(tmp_path, monkeypatch):
    clips = [clip(), clip("09_02", 20), clip("09_03", 40)]
    monkeypatch.setattr(module, "read_clips", lambda subjects: clips)
    judged = finished(Configuration(), [module.EvaluationSet("train", "train")])
    for lift in (lambda: write_takes("train", tmp_path / "takes.npz"), lambda: next(judged)):
        with refused("files-apart"):
            lift()
    write_takes("test", tmp_path / "takes.npz")
    with np.load(tmp_path / "takes.npz", allow_pickle=False) as file:
        assert file["take_start"].tolist() == [0, 50, 90]  # 20 frames are too few
        assert file["clip"].tolist() == ["09_01", "09_03"]
        np.testing.assert_allclose(file["truth"][:50], see(clip(), 0).truth, atol=1e-6)
    before = (tmp_path / "takes.npz").read_bytes()
    write_takes("train", tmp_path / "takes.npz", trained_on=True)
    assert (tmp_path / "takes.npz").read_bytes() == before


@pytest.fixture
def walk(monkeypatch):
    clip = walked(seconds=3)
    monkeypatch.setattr(module, "read_clips", lambda subjects: (clip,))
    return clip


def tilt(one):
    up = one.take.rectified.R_source_from_level[..., 2]
    return angle_deg(*np.broadcast_arrays(up, one.truth.up))


@pytest.mark.parametrize(
    ("asked", "most_deg", "labels"),
    [
        ({"up_told": True}, 1.0, ["CMU test", "HDM05"]),
        ({"image": True, "camera": "moving", "fps": 60.0}, 2.0, ["CMU test"]),
        ({"image": True, "lifter": ""}, 2.0, ["CMU test"]),
    ],
)
def test_a_take_is_finished_and_its_truth_is_that_of_its_frames(walk, asked, most_deg, labels):
    configuration = Configuration(people="test", bed="typical", **asked)
    takes = list(islice(finished(configuration), len(labels)))
    assert [one.label for one in takes] == labels
    assert {(one.truth.subject, one.truth.clip) for one in takes} == {("03", "03_01")}
    one = takes[0]
    assert one.take.poses.fps == pytest.approx(configuration.fps)
    assert len(one.take.poses) == len(one.truth.truth)
    assert one.truth.up.shape == ((3,) if configuration.camera == "static" else (len(one.truth.truth), 3))
    assert tilt(one).mean() < most_deg
    np.testing.assert_allclose(at_rate(walk, 60.0).joints[::2], walk.joints, atol=1e-5)
    assert np.isfinite(one.take.kinematics["r_knee_flexion_deg"]).any()


def test_errors_are_fitted_to_takes_and_judged_with_the_file(walk, tmp_path, monkeypatch):
    monkeypatch.setattr(
        report, "ANGLES", {name: ANGLES[name] for name in ("r_knee_flexion", "l_knee_flexion")}
    )
    asked = {"sets": "tennis", "because": "a test", "seed": 3, "part": ["bodies alone"]}
    evaluate("errors", tmp_path / "fitted", fit=True, **asked)
    path = tmp_path / "fitted" / "joint_noise.json"
    assert read_noise(path).lifter == load_lifter().method
    evaluate("errors", tmp_path / "judged", errors=path, draws=2, **asked)
    judged = json.loads((tmp_path / "judged" / "evaluation.json").read_text())
    assert (judged["judged"], judged["draws"]) == ("tennis", 2)
    assert judged["statements"]["knee_flexion"]["bodies alone"]["inside"] == pytest.approx(0.9, abs=0.05)
