"""The study's table, and what makes a take another one."""

import json
from dataclasses import replace

import numpy as np
import pytest

from golden.measures import rows_of
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import RunOptions, read_run, run_files
from pcnet3d.pipeline.core.measures import Measure
from pcnet3d.pipeline.plugins import registry
from pcnet3d.stages.study.batch.command import study_rows
from pcnet3d.stages.study.batch.manifest import Entry
from pcnet3d.stages.study.batch.study import _shown, as_page, figures
from pcnet3d.stages.study.batch.take import Outcome, result_key

SAID = {"code": "no-scale", "weight": "warning", "about": "", "text": "careful"}


def figureless(name="t", **more):
    """A row of a take whose run has no figures."""
    labels = {"name": name, "subject": "", "visit": "", "condition": "", "state": "done"}
    return {**labels, "level_ok": None, "judgement": "", "frames": None, "measures": {}, **more}


def test_people_of_one_take_are_counted_as_one_take():
    entry = Entry("t", RunOptions(), {"subject": "", "visit": "", "condition": ""})
    people = [{"person": p, "level_ok": p != "1", "judgement": "suspicious", "measures": {}} for p in "012"]
    page = as_page("Study", study_rows([entry], [Outcome("t", "done", rows=tuple(people))]))
    assert "1 take done, 0 failed." in page
    assert "Of 3 runs: 3 with suspicious poses, 1 not levelled." in page
    assert "3 runs with suspicious poses: t, 0; t, 1; t, 2<" in page
    assert "1 run not levelled: t, 1<" in page


def test_a_take_without_figures_is_neither_without_doubts_nor_not_levelled():
    """As after `--set export=off`."""
    rows = [figureless(name) for name in ("a", "b")]
    page = as_page("Study", rows)
    assert "2 takes done, 0 failed." in page
    assert "Of 2 runs: 2 whose poses cannot be judged." in page
    assert "2 runs whose poses cannot be judged: a; b<" in page
    assert ">levelled<" not in page  # a column without a cell
    rows[1] |= {"level_ok": True, "frames": 45, "judgement": "good"}
    page = as_page("Study", rows)
    assert "1 run whose poses cannot be judged: a<" in page
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
    assert {key: measure.unit for key, measure in found["measures"].items()} == {
        "walking.steps": "",
    }
    assert [each["text"] for each in found["notices"]] == [SAID["text"], "a name ?"]
    assert (found["frames"], found["fps"], found["method"]) == (60, pytest.approx(30), "geometric")
    assert found["report"] == ""
    (run / "report.html").write_text("")
    assert figures(run)[0]["report"] == "takes/a/report.html"


def test_the_page_shows_figures_that_takes_are_compared_by_and_counts(made):
    """No length without a scale."""
    figures = {
        "walking": {
            "frames": 60, "cadence_spm": 100.0, "cadence_error_spm": 1.0, "walking_speed": 1.2,
            "walking_speed_error": 0.1, "landings_s": [1.0],
        },
        "off_keypoints": {"r_arm": {"start_s": [3.0], "stop_s": [4.0]}},
        "knee_bends": {"count": 3.0},
        "range_of_motion": {"r_knee_flexion": {"p05_p95_deg": 50.0, "p95_deg": 60.0}},
    }  # fmt: skip
    take = read_run(made()).with_(measures=rows_of(figures))
    frame = take.need("poses").frame
    others = {"walking.cadence", "knee_bends.count", "range_of_motion.r_knee_flexion.p05_p95"}
    assert set(_shown(take)) == {*others, "walking.walking_speed"}  # metres
    without_scale = take.with_(poses=take.need("poses").with_(frame=frame.with_(unit="arbitrary")))
    assert set(_shown(without_scale)) == others


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (97.31, 2.4, "97 ± 4"),
        (97.31, 0.0, "97.31 ± 0"),
        (97.31, None, "97"),
        (1.234, None, "1.2"),
        (123.0, None, "123"),
    ],
)
def test_a_figure_has_the_digits_that_it_has_in_its_report(value, error, shown):
    """One without an error had three, and the bar of another two digits more."""
    of = Measure("cadence", value, error, group=("walking",))
    assert of.in_words() == shown
    assert f">{shown}</td>" in as_page("Study", [figureless(measures={"walking.cadence": of})])


def test_a_count_that_may_be_more_is_said_to_be():
    """The report had "at least 3 squats", the study's page 3."""
    for at_least in (True, False):
        of = Measure("count", 3, at_least=at_least, group=("knee_bends",))
        page = as_page("Study", [figureless(measures={"knee_bends.count": of})])
        assert f">3{' or more' * at_least}</td>" in page


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
