"""The report as part of a run."""

import json

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running import command
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry, load_recipe
from pcnet3d.pipeline.running.run import run_files


def recipe(**options) -> Recipe:
    stages = [{"use": "rectify", "rectifier": "geometric"}, {"use": "report", **options}]
    return Recipe(stages=stages)  # type: ignore[arg-type]


@pytest.fixture
def sources(film, tmp_path) -> RunOptions:
    walk, lifted = walker(seconds=2.0), tmp_path / "poses.npy"
    np.save(lifted, camera_poses(walk, side_camera(walk)).joints)
    return RunOptions(poses=lifted, adapter="motionbert", video=film().path)


def test_a_run_leaves_the_report_in_its_folder(sources, tmp_path):
    run_files(sources, tmp_path / "out", recipe())
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"report.html", "summary.json"}
    assert "data:image/jpeg" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_title_person_and_date_stand_in_report_and_summary(sources, tmp_path):
    told = {"title": "Visit <1>", "person_id": "P-07", "date": "2026-03-31"}
    stages = (*recipe().stages, StageEntry(use="export"))
    geometric = Recipe(
        stages=(stages[0], StageEntry(use="trajectories"), StageEntry(use="angles"), *stages[1:])
    )
    take = run_files(sources.with_(**told), tmp_path / "out", geometric)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<title>Visit &lt;1&gt;</title>" in page
    assert "<h1>Visit &lt;1&gt;</h1>" in page
    assert f"Person P-07 · 2026-03-31 · {take.name}" in page
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["session"] == told
    run_files(sources, tmp_path / "bare", geometric)
    assert f"<h1>{take.name}</h1>" in (tmp_path / "bare" / "report.html").read_text(encoding="utf-8")
    assert json.loads((tmp_path / "bare" / "summary.json").read_text())["session"] == {}


def test_the_folder_is_the_runs_own(sources, tmp_path):
    with pytest.raises(InputError, match="-o DIR"):
        run_files(sources, tmp_path / "out", recipe(folder=str(tmp_path)))


def test_the_report_is_the_last_stage_of_the_default_recipe():
    assert load_recipe().stages[-1].use == "report"


def test_no_frames_on_the_command_line_is_told_to_all_stages(monkeypatch, tmp_path):
    asked = {}

    class EnoughError(Exception):
        pass

    def run(options, output, **others):
        asked.update(images=options.told.images)
        raise EnoughError

    monkeypatch.setattr(command, "run_files", run)
    with pytest.raises(EnoughError):
        command.run(output=tmp_path / "out", poses=tmp_path / "poses.npy", no_frames=True)
    assert asked == {"images": False}
