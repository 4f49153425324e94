"""The runner of reports: its options, sets of people, and the ledger of looks at test people."""

import csv

import numpy as np
import pytest

from pcnet3d.models.lab import beds as runs
from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.evaluation import evaluate as reports
from pcnet3d.pipeline import InputError
from refusals import refused


def clip_of(name, frames):
    return Clip(name, name.partition("_")[0], "asfamc", 30.0, np.zeros((frames, 17, 3), np.float32))


@pytest.mark.parametrize("report", ["takes", "errors"])
def test_a_set_without_takes_is_refused_before_the_work(tmp_path, monkeypatch, report):
    clips = [
        clip_of(name, frames) for name, frames in (("09_01", 50), ("accad-m1_01", 20), ("tennis-a_01", 50))
    ]
    monkeypatch.setattr(runs, "see", lambda *_, **__: pytest.fail("it works"))
    monkeypatch.setattr(runs, "read_clips", lambda subjects: clips)
    with refused("nothing-usable"):
        reports.evaluate(report, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("asked", [{"sets": "test"}, {"sets": "test", "because": " "}, {"because": "I may"}])
def test_test_subjects_are_looked_at_for_a_reason_only(tmp_path, asked, monkeypatch):
    monkeypatch.setattr(runs, "read_clips", lambda subjects: pytest.fail("it looks"))
    with pytest.raises(InputError, match="--because"):
        reports.evaluate("takes", tmp_path / "out", **asked)
    assert not (tmp_path / "out").exists()


def test_a_report_takes_its_own_options_alone(tmp_path):
    for report, asked in (
        ("gait", {"part": ["typical"]}),
        ("real-take", {"seed": 1}),
        ("lifter", {"bed": "wild"}),
    ):
        with refused("option-conflict"):
            reports.evaluate(report, tmp_path / "out", **asked)
    with refused("name-unknown"):
        reports.evaluate("take", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_looks_at_test_subjects_are_kept(tmp_path, monkeypatch):
    for reason in ("first", "a comma, and\na line"):
        reports.note_look(tmp_path, "pcnet3d lab evaluate takes", ["pcnet3d@1", "pcnet@2"], reason)
    with open(tmp_path / "ledger.csv", newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert first["networks"] == "pcnet3d@1 pcnet@2"
    assert second["because"] == "a comma, and a line"
    for folder in (".git", "docs/accuracy"):
        (tmp_path / "repository" / folder).mkdir(parents=True)
    monkeypatch.setattr(reports, "ROOT", tmp_path / "repository")
    reports.note_look(tmp_path, "pcnet3d lab evaluate takes", [], "in the repository")
    assert (tmp_path / "repository" / "docs" / "accuracy" / "ledger.csv").exists()
