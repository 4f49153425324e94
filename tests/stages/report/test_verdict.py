"""What inspect says of poses stands in a run's last line, its report, recording, summary and the study's table."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import Pipeline, Take, read_run
from pcnet3d.pipeline.core.notices import verdict
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.reading.findings import findings_of
from pcnet3d.pipeline.running.sentences import POSES_ARE, conclude, judgement, trusted
from pcnet3d.stages.drawing.facts import provenance
from pcnet3d.stages.export.stage import Export, summary
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.report.stage import report
from pcnet3d.stages.study.batch.study import as_page, figures


@pytest.fixture(scope="module")
def takes():
    """The walker, and the same with every other row a repeat of the one before."""
    walk = walker(seconds=4).poses
    shaking = np.random.default_rng(0).normal(
        0, 1e-3, walk.joints.shape
    )  # or it would stand still to the digit
    walk = walk.with_(joints=walk.joints + shaking)
    joints = walk.joints.copy()
    joints[1::2] = joints[: len(joints) // 2 * 2 : 2]
    made = {"good": walk, "bad": walk.with_(joints=joints)}
    return {
        name: Pipeline((Rectify(),))(Take(name, poses=poses, findings=findings_of(poses)))
        for name, poses in made.items()
    }


def test_a_run_repeats_what_inspect_says(takes, capsys, tmp_path):
    for name, take in takes.items():
        word = verdict(take.findings)
        assert (word == "good") == (name == "good")
        assert judgement(take) == word
        conclude({"": take}, tmp_path)
        assert f"\nThe poses are {word}" in capsys.readouterr().out
        assert provenance(take)["verdict"] == f"The poses are {word}"
        page = report(take)
        assert f"The poses are {word}</dt>" in page
        said = summary(take)
        assert said["verdict"] == said["judgement"] == word
        texts = [finding["text"] for finding in said["notices"] if finding["about"] == "poses"]
        assert bool(texts) == (name == "bad")
        assert all(text.split(":")[0][:20] in page for text in texts)
        run = tmp_path / "takes" / name
        run.mkdir(parents=True)
        Export(run)(take.with_(kinematics={}))
        (row,) = figures(run)
        assert row["verdict"] == row["judgement"] == word
        labels = dict.fromkeys(("subject", "visit", "condition"), "")
        shown = as_page("study", [{"name": name, "state": "done", **labels, **row}])
        assert f"<td>{POSES_ARE[word]}</td>" in shown


def test_nothing_is_said_of_poses_that_nobody_looked_at(takes, capsys, tmp_path):
    take = takes["good"].with_(findings=None)
    conclude({"": take}, tmp_path)
    assert "poses are" not in capsys.readouterr().out
    assert summary(take)["verdict"] is summary(take)["judgement"] is None
    assert "poses are" not in report(take)


@pytest.mark.parametrize(
    ("kind", "basis"),
    [("measured", "none"), ("estimated", "none"), ("unknown", "none"), ("estimated", "disagreement")],
)
def test_poses_are_good_only_if_something_tells_how_far_they_are_off(takes, kind, basis, tmp_path):
    """Poses of which nobody said who made them were "good" in the report, those of an estimator of unknown error in the
    study's page; a foreign lifter's take that was off by 146 mm was good."""
    of = takes["good"]
    take = of.with_(poses=of.poses.with_(made_by=MadeBy(kind)), angle_errors=basis, kinematics={})
    expected = "good" if kind == "measured" or basis == "disagreement" else "error-unknown"
    assert (take.verdict, judgement(take)) == ("good", expected)
    words = trusted(take)
    assert ("The poses are good" in words, "cannot be judged" in words) == (
        expected == "good",
        expected != "good",
    )
    Export(tmp_path)(take)
    assert judgement(read_run(tmp_path)) == expected
    assert figures(tmp_path)[0]["judgement"] == expected


def test_of_poses_that_lack_joints_in_most_frames_only_what_was_seen_is_good(takes):
    poses = takes["good"].poses
    joints = poses.joints.copy()
    joints[: len(joints) * 2 // 3, poses.layout.index("l_wrist")] = np.nan
    assert judgement(takes["good"].with_(poses=poses.with_(joints=joints))) == "joints-missing"
