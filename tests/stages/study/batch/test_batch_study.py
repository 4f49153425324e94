"""The study's table, and what makes a take another one."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import RunOptions, run_files
from pcnet3d.pipeline.plugins import registry
from pcnet3d.stages.study.batch.command import study_rows
from pcnet3d.stages.study.batch.manifest import Entry
from pcnet3d.stages.study.batch.study import as_page, figures
from pcnet3d.stages.study.batch.take import Outcome, result_key

SAID = {"code": "no-scale", "weight": "warning", "about": "", "text": "careful"}


def figureless(name="t", **more):
    """A row of a take whose run has no figures."""
    labels = {"name": name, "subject": "", "visit": "", "condition": "", "state": "done"}
    return {**labels, "level_ok": None, "judgement": "", "frames": None, **more}


def test_people_of_one_take_are_counted_as_one_take():
    entry = Entry("t", RunOptions(), {"subject": "", "visit": "", "condition": ""})
    people = [{"person": p, "level_ok": p != "1", "judgement": "suspicious"} for p in "012"]
    page = as_page("Study", study_rows([entry], [Outcome("t", "done", rows=tuple(people))]))
    assert "1 take done, 0 failed." in page
    assert "Of 3 runs: 3 with suspicious poses, 1 not levelled." in page


def test_a_take_without_figures_is_neither_without_doubts_nor_not_levelled():
    """As after `--set export=off`."""
    rows = [figureless(name) for name in ("a", "b")]
    page = as_page("Study", rows)
    assert "2 takes done, 0 failed." in page
    assert "Of 2 runs: 2 whose poses cannot be judged." in page
    assert ">levelled<" not in page  # a column without a cell
    rows[1] |= {"level_ok": True, "frames": 45, "judgement": "good"}
    page = as_page("Study", rows)
    assert "Of 2 runs: 1 whose poses cannot be judged." in page
    assert (page.count(">yes<"), page.count(">no<")) == (1, 0)


@pytest.fixture
def made(tmp_path):
    """A run's folder in a study's, with measures of a test's own, and what goes into its summary."""
    folder, walk = tmp_path / "takes" / "a", walker()
    np.save(tmp_path / "X3D.npy", camera_poses(walk, side_camera(walk)).joints[:60])
    off = {"record": "off", "report": "off", "measures": "off", "rectify.rectifier": "geometric"}
    run_files(RunOptions(poses=tmp_path / "X3D.npy", adapter="videopose3d", fps=30, settings=off), folder)

    def write(**entries):
        summary = json.loads((folder / "summary.json").read_text())
        (folder / "summary.json").write_text(json.dumps({**summary, **entries}))
        return folder

    return write


def test_figures_are_single_numbers_by_their_keys(made):
    measures = {
        "walking": {"steps": 3, "right": {"mean_step_time_s": 0.5}, "landings_s": [1.0], "gait": "running"}
    }
    device = {"asked": "auto", "networks": {"a.onnx": "cuda", "b.onnx": "cpu", "c.onnx": "cuda"}}
    of_run = {**SAID, "rows": None, "values": {}}
    run = made(measures=measures, notices=[of_run, {**of_run, "text": "a name \udcff"}], device=device)
    (found,) = figures(run)
    assert found["device"] == "cpu, cuda"
    assert found["numbers"] == {"walking.steps": 3.0, "walking.right.mean_step_time_s": 0.5}
    assert isinstance(found["numbers"]["walking.steps"], float)
    assert [each["text"] for each in found["notices"]] == [SAID["text"], "a name ?"]
    assert (found["frames"], found["fps"], found["method"]) == (60, pytest.approx(30), "geometric")
    assert found["report"] == ""
    (run / "report.html").write_text("")
    assert figures(run)[0]["report"] == "takes/a/report.html"


@pytest.fixture
def entry(tmp_path) -> Entry:
    (tmp_path / "a.npy").write_bytes(b"some poses")
    path = tmp_path / "a.npy"
    return Entry("a", RunOptions(poses=path, fps=30), {"subject": "s"})


def test_a_take_is_another_one_when_its_content_its_options_or_a_version_changes(
    entry, tmp_path, monkeypatch
):
    first = result_key(entry)
    assert result_key(replace(entry, name="b", labels={"subject": "t"})) == first
    assert result_key(replace(entry, options=entry.options.with_(fps=25))) != first
    (tmp_path / "elsewhere").mkdir()
    moved = (tmp_path / "a.npy").rename(tmp_path / "elsewhere" / "a.npy")
    entry = replace(entry, options=entry.options.with_(poses=moved))
    assert result_key(entry) == first
    moved.write_bytes(b"other poses")
    assert result_key(entry) != first
    moved.write_bytes(b"some poses")
    assert result_key(entry) == first
    known = dict(registry.registered("stages"))
    monkeypatch.setattr(registry, "installed", dict)
    assert known
    assert result_key(entry) != first


def test_of_a_file_that_a_setting_names_what_it_holds_counts_and_not_where_it_lies(entry, tmp_path):
    one, other = tmp_path / "m.onnx", tmp_path / "elsewhere/m.onnx"
    other.parent.mkdir()
    for path in (one, other):
        path.write_bytes(b"one")
    keys = [
        result_key(replace(entry, options=entry.options.with_(settings={"rectify.rectifier": str(path)})))
        for path in (one, other)
    ]
    assert keys[0] == keys[1] != result_key(entry)
    other.write_bytes(b"two")
    options = entry.options.with_(settings={"rectify.rectifier": str(other)})
    assert result_key(replace(entry, options=options)) != keys[0]


@pytest.mark.parametrize(
    ("stage", "named"), [("rectify", 'rectifier = "m.onnx"'), ("calibrate", 'camera_file = "camera.toml"')]
)
def test_a_file_that_a_recipe_names_counts_too(entry, tmp_path, monkeypatch, stage, named):
    monkeypatch.chdir(tmp_path)
    file, recipe = tmp_path / named.split('"')[1], tmp_path / "r.toml"
    file.write_bytes(b"one")
    recipe.write_text(f'[[stages]]\nuse = "{stage}"\n{named}\n')
    entry = replace(entry, options=entry.options.with_(recipe=recipe))
    first = result_key(entry)
    file.write_bytes(b"two")
    assert result_key(entry) != first
