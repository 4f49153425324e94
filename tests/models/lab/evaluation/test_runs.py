"""Finished takes: what a run leaves, beside a truth that knows it."""

import json
from itertools import islice

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.angle_error.joint_noise import read_noise
from pcnet3d.models.lab.evaluation import errors as report
from pcnet3d.models.lab.evaluation import runs
from pcnet3d.models.lab.evaluation.evaluate import evaluate
from pcnet3d.models.lab.evaluation.runs import Configuration, at_rate, finished
from pcnet3d.models.lifter.load import load_lifter
from pcnet3d.pipeline import angle_deg
from pcnet3d.pipeline.signals.angles import ANGLES


@pytest.fixture
def clip(monkeypatch):
    clip = walked(seconds=3)
    monkeypatch.setattr(runs, "read_clips", lambda subjects: (clip,))
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
def test_a_take_is_finished_and_its_truth_is_that_of_its_frames(clip, asked, most_deg, labels):
    configuration = Configuration(people="test", bed="typical", **asked)
    takes = list(islice(finished(configuration), len(labels)))
    assert [one.label for one in takes] == labels
    assert {(one.truth.subject, one.truth.clip) for one in takes} == {("03", "03_01")}
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


def test_errors_are_fitted_to_takes_and_judged_with_the_file(clip, tmp_path, monkeypatch):
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
