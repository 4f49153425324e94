"""The report as part of a run."""

import json

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry
from pcnet3d.pipeline.running.run import run_files


def recipe(**options) -> Recipe:
    stages = [{"use": "rectify", "rectifier": "geometric"}, {"use": "report", **options}]
    return Recipe(stages=stages)  # type: ignore[arg-type]


@pytest.fixture
def sources(film, tmp_path) -> RunOptions:
    walk, lifted = walker(seconds=2.0), tmp_path / "poses.npy"
    np.save(lifted, camera_poses(walk, side_camera(walk)).joints)
    return RunOptions(poses=lifted, adapter="motionbert", video=film().path)


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
    assert "data:image/jpeg" in page
    run_files(sources, tmp_path / "bare", recipe())
    assert {path.name for path in (tmp_path / "bare").iterdir()} == {"report.html", "summary.json"}
