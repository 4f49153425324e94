"""The runner of reports: its options, sets of people, and the ledger of looks at test people."""

import csv
from dataclasses import replace

import pytest

from pcnet3d.models.lab import beds as runs
from pcnet3d.models.lab.evaluation import evaluate as reports
from pcnet3d.pipeline import InputError
from refusals import refused


@pytest.mark.parametrize("report", ["takes", "errors"])
def test_a_set_without_takes_is_refused_before_the_work(tmp_path, monkeypatch, report, clips):
    short = replace(clips["val"][0], name="accad-m1_01", joints=clips["val"][0].joints[:20])
    monkeypatch.setattr(runs, "see", lambda *_, **__: pytest.fail("it works"))
    monkeypatch.setattr(runs, "read_clips", lambda subjects: (short, *clips["val"], *clips["tennis"]))
    with refused("nothing-usable"):
        reports.evaluate(report, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("asked", [{"sets": "test"}, {"sets": "test", "because": " "}, {"because": "I may"}])
def test_test_subjects_are_looked_at_for_a_reason_only(tmp_path, asked, monkeypatch):
    monkeypatch.setattr(runs, "read_clips", lambda subjects: pytest.fail("it looks"))
    with pytest.raises(InputError, match="--because"):
        reports.evaluate("takes", tmp_path / "out", **asked)
    assert not (tmp_path / "out").exists()


@pytest.mark.data
def test_a_report_takes_its_own_options_alone(tmp_path):
    for report, asked in (("gait", {"part": ["typical"]}), ("lifter", {"bed": "wild"})):
        with refused("option-conflict"):
            reports.evaluate(report, tmp_path / "out", **asked)
    with refused("name-unknown"):
        reports.evaluate("take", tmp_path / "out")
    with refused("name-unknown"):
        reports.measured("errors", runs.Configuration(part=["imagee"]), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_looks_at_test_subjects_are_kept_and_in_a_repository_with_its_figures(tmp_path, monkeypatch):
    for folder in (".git", "docs/accuracy"):
        (tmp_path / "repository" / folder).mkdir(parents=True)
    monkeypatch.setattr(reports, "ROOT", tmp_path / "repository")
    for reason in ("first", "a comma, and\na line"):
        reports.note_look(tmp_path, "pcnet3d lab evaluate takes", ["pcnet3d@1", "pcnet@2"], reason)
    kept = tmp_path / "repository" / "docs" / "accuracy" / "ledger.csv"
    with open(kept, newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert first["networks"] == "pcnet3d@1 pcnet@2"
    assert second["because"] == "a comma, and a line"
