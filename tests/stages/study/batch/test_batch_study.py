"""The study's table: changes within subjects with known answers, and what makes a take another one."""

import json
from dataclasses import replace

import numpy as np
import pytest

from golden.measures import by_place, rows_of
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError, RunOptions, read_run, run_files
from pcnet3d.pipeline.core.measures import Measure
from pcnet3d.pipeline.plugins import registry
from pcnet3d.stages.export.measures import write_measures
from pcnet3d.stages.study.batch.command import study_rows
from pcnet3d.stages.study.batch.manifest import Entry
from pcnet3d.stages.study.batch.page import as_page
from pcnet3d.stages.study.batch.study import _comparable, changes, figures, rates_within
from pcnet3d.stages.study.batch.take import Outcome, _hashes, _kept, _key

SAID = {"code": "no-scale", "weight": "warning", "about": "", "text": "careful"}
NAME = "range_of_motion.r_knee_flexion.p05_p95_deg"


def row(subject, visit, value, condition=""):
    labels = {"subject": subject, "visit": visit, "condition": condition}
    measures = {} if value is None else by_place({NAME: value})
    return {**labels, "level_ok": True, "judged": False, "gait": "", "measures": measures}


def figureless(name="t", **more):
    """A row of a take whose run has no figures."""
    labels = {"name": name, "subject": "", "visit": "", "condition": "", "state": "done"}
    return {**labels, "level_ok": None, "verdict": "", "frames": None, "measures": {}, **more}


CADENCE = "walking.cadence_spm"


def study(subjects: int, knee: float, cadence: float):
    rng = np.random.default_rng(1)
    noise = rng.normal(0, 1, (subjects, 2))
    rows = []
    for i in range(subjects):
        for later, visit in enumerate("12"):
            numbers = {
                NAME: 60 + later * (knee + noise[i, 0]),
                CADENCE: 100 + later * (cadence + noise[i, 1]),
            }
            rows.append({**row(f"s{i}", visit, None), "gait": "walking", "measures": by_place(numbers)})
    return rows


def test_nothing_is_said_to_change_of_fewer_than_six():
    assert {change.differs for change in changes(study(5, 50.0, 50.0))} == {None}
    assert {change.differs for change in changes(study(6, 50.0, 50.0))} == {True}


def test_the_primary_outcome_is_tested_without_correction_and_the_others_with():
    rng = np.random.default_rng(2)
    names = [f"range_of_motion.{i}.p05_p95_deg" for i in range(40)]
    values = 50 + rng.normal(0, 1, (8, 2, 40)).round(3)
    values[:, 1] += 0.9 * (np.arange(40) == 0)
    rows = [
        {
            **row(f"s{s}", "12"[v], None),
            "measures": by_place(dict(zip(names, values[s, v].tolist(), strict=True))),
        }
        for s in range(8)
        for v in range(2)
    ]
    free = {change.measure: change for change in changes(rows)}
    declared = {change.measure: change for change in changes(rows, names[0])}
    assert declared[names[0]].primary
    assert declared[names[0]].differs == (declared[names[0]].p <= 0.05)
    # No other one is told where nothing changed, though some have p <= 0.05 by chance.
    assert any(change.p <= 0.05 for name, change in free.items() if name != names[0])
    assert not any(change.differs for name, change in declared.items() if name != names[0])


@pytest.mark.parametrize("doubt", [{"level_ok": False}, {"verdict": "unusable"}])
def test_a_take_that_is_not_to_be_believed_has_no_say(doubt):
    rows = [row(s, v, 1.0 + (v == "2")) for s in "abc" for v in "12"]
    rows[-1] |= {**doubt, "measures": by_place({NAME: 100.0})}
    (change,) = changes(rows)
    assert (change.n, change.bias) == (2, 1.0)


def test_people_of_one_take_are_not_averaged_into_its_subject():
    rows = [row(s, v, 1.0 + (v == "2")) for s in "ab" for v in "12"]
    crowd = [
        {**row("c", v, 100.0 * (v == "2")), "name": f"c_{v}", "person": person}
        for v in "12"
        for person in "01"
    ]
    alone = [{**row("d", v, 1.0 + (v == "2")), "name": f"d_{v}", "person": "0"} for v in "12"]
    (change,) = changes([*rows, *crowd, *alone])
    assert (change.n, change.bias) == (3, 1.0)


def test_the_mean_change_and_its_interval_by_hand():
    rows = [row(f"s{i}", visit, value) for visit, values in (("one", (50, 60, 70)), ("two", (51, 63, 75)))
            for i, value in enumerate(values)]  # fmt: skip
    (change,) = changes(rows)
    assert (change.factor, change.measure, change.n) == ("visit", NAME, 3)
    assert (change.earlier, change.later) == ("one", "two")
    assert change.bias == pytest.approx(3.0)
    assert change.sd == pytest.approx(2.0)
    margin = 4.3027 * 2 / np.sqrt(3)  # Student's t of two degrees of freedom, 97.5 %
    assert (change.mean_lower, change.mean_upper) == pytest.approx((3 - margin, 3 + margin), abs=1e-3)
    assert change.mean_lower <= 0 <= change.mean_upper


def test_what_rounding_alone_can_make_is_no_change():
    """Stance in whole percents, of three whose true change may be 0.1."""
    pairs = ((60.0, 61.0), (62.0, 63.0), (58.0, 59.0))
    rows = [
        row(f"s{i}", v, value) for i, pair in enumerate(pairs) for v, value in zip("12", pair, strict=True)
    ]
    (change,) = changes(rows)
    assert change.sd == pytest.approx(np.sqrt(1 / 6))  # of the difference of two whole numbers
    assert change.mean_lower <= 0 <= change.mean_upper
    finer = [*rows, row("s0", "1", 60.1)]  # what is known to a tenth everywhere is not the rounding's
    (change,) = changes(finer)
    assert not change.mean_lower <= 0 <= change.mean_upper


@pytest.mark.parametrize("sd", [0.1, 0.5, 1.0])
def test_rounded_figures_of_unchanged_subjects_seldom_change(sd):
    """As the page says: one of twenty by chance, and no more for the rounding."""
    rng = np.random.default_rng(0)
    for n in (2, 3, 6):
        values = np.round(rng.uniform(50, 60, (2000, n, 1)) + rng.normal(0, sd, (2000, n, 2)))
        names = [f"range_of_motion.{i}.p05_p95_deg" for i in range(len(values))]
        rows = [
            {
                **row(f"s{s}", "12"[v], 0.0),
                "measures": by_place(dict(zip(names, values[:, s, v].tolist(), strict=True))),
            }
            for s in range(n)
            for v in range(2)
        ]
        assert (
            np.mean([not change.mean_lower <= 0 <= change.mean_upper for change in changes(rows)]) < 0.065
        ), n


def test_what_differs_by_more_than_its_rounding_keeps_its_spread():
    rows = [row(f"s{i}", v, 10.0 * i + (v == "2") * (i + 1)) for i in range(3) for v in "12"]
    (change,) = changes(rows)
    assert (change.bias, change.sd) == pytest.approx((2.0, 1.0))


def test_the_page_names_a_real_change_before_one_that_was_rounded_to_the_same():
    """Six subjects: knees by 8 to 12 degrees, thighs by what was rounded to 1 in all."""
    hip = NAME.replace("knee", "thigh_trunk")
    rows = [row(f"s{i}", v, 60.0 + i + (8.0 + i % 5) * (v == "2")) for i in range(6) for v in "12"]
    for i, one in enumerate(rows):
        one["measures"] |= by_place({hip: 40.0 + i // 2 + i % 2})
    page = as_page("Study", [{**one, "name": "t", "state": "done"} for one in rows], changes(rows))
    assert page.index("knee flexion (°) +9.67") < page.index("thigh against trunk (°) +1")


def test_the_first_visit_is_the_one_that_the_manifest_names_first():
    rows = [row(s, v, value + (s == "b")) for v, value in (("10", 1.0), ("9", 5.0)) for s in "ab"]
    rows.append(row("a", "8", 0.0))
    (change,) = changes(rows)  # the third visit has one subject only
    assert (change.earlier, change.later, change.bias) == ("10", "9", 4.0)


@pytest.mark.parametrize(
    "trouble", [{"state": "failed"}, {"level_ok": False}], ids=["failed", "not levelled"]
)
def test_the_first_visit_stays_the_first_when_its_first_take_is_of_no_use(trouble):
    rows = [row(s, v, 50.0 + 10 * (v == "after")) for s in "abc" for v in ("before", "after")]
    if "state" in trouble:
        rows[0] = {key: rows[0][key] for key in ("subject", "visit", "condition")}
    rows[0] |= trouble
    (change,) = changes(rows)
    assert (change.earlier, change.later, change.n, change.bias) == ("before", "after", 2, 10.0)


def test_where_no_take_of_the_first_visit_can_be_used_the_next_one_is_compared():
    rows = [row(s, v, float(v)) for v in "123" for s in "ab"]
    for of_first in rows[:2]:
        of_first["level_ok"] = False
    assert [(one.earlier, one.later, one.bias) for one in changes(rows)] == [("2", "3", 1.0)]


def test_people_of_one_take_are_counted_as_one_take():
    entry = Entry("t", {}, (), {"subject": "", "visit": "", "condition": ""})
    people = [{"person": p, "level_ok": p != "1", "verdict": "suspicious", "measures": {}} for p in "012"]
    page = as_page("Study", study_rows([entry], [Outcome("t", "done", rows=tuple(people))]), [])
    assert "1 take done, none failed; 1 of them with doubts." in page
    assert "3 runs with suspicious poses: t, 0; t, 1; t, 2<" in page
    assert "1 run not levelled: t, 1<" in page


def test_a_take_without_figures_is_neither_without_doubts_nor_not_levelled():
    """As after `--set export=off`."""
    rows = [figureless(name) for name in ("a", "b")]
    page = as_page("Study", rows, [])
    assert "2 takes done, none failed; 2 of them with doubts." in page
    assert "2 runs that cannot be judged: a; b<" in page
    assert ">levelled<" not in page  # a column without a cell
    rows[1] |= {"level_ok": True, "frames": 45}
    page = as_page("Study", rows, [])
    assert "1 run that cannot be judged: a<" in page
    assert (page.count(">yes<"), page.count(">no<")) == (1, 0)


def test_a_posture_whose_joints_are_not_all_known_is_drawn():
    """batch.json holds null for them."""
    posture = [[0.1, 0.2, float(i)] for i in range(16)] + [[None] * 3]
    assert "<svg" in as_page("Study", [figureless(posture=posture)], [])


def test_a_subject_counts_once_however_many_takes_there_are():
    rows = [row("a", "1", 10.0)] * 5 + [
        row("a", "1", 16.0),
        row("a", "2", 13.0),
        row("b", "1", 0.0),
        row("b", "2", 4.0),
    ]
    (change,) = changes(rows)
    assert change.n == 2
    assert change.bias == pytest.approx(((13 - 11) + 4) / 2)


def test_visits_are_compared_within_a_condition():
    """Shod takes have 100 more; a subject who has them at one visit only does not change by 100."""
    rows = [row(s, v, 10.0 * (v == "2"), "bare") for s in "ab" for v in "12"] + [row("a", "2", 110.0, "shod")]
    assert [(c.factor, c.bias) for c in changes(rows)] == [("visit", 10.0)]
    rows.append(row("b", "2", 114.0, "shod"))
    found = {c.factor: c for c in changes(rows)}
    assert found["visit"].bias == pytest.approx(10.0)
    assert (found["condition"].bias, found["condition"].n) == (pytest.approx(102.0), 2)


@pytest.mark.parametrize(
    "rows",
    [
        [],
        [row("a", "1", 1.0), row("a", "2", 2.0)],
        [row("a", "1", 1.0), row("b", "2", 2.0)],
        [row("", "1", 1.0), row("", "2", 2.0)] * 3,
        [{"subject": "a", "visit": "1", "condition": ""}, {"subject": "b", "visit": "2", "condition": ""}],
        [row("a", "1", None), row("a", "2", 2.0), row("b", "1", 1.0), row("b", "2", 1.0)],
    ],
    ids=["nothing", "one subject", "nobody twice", "nobody named", "failed", "missing"],
)
def test_nothing_is_said_of_fewer_than_two_subjects(rows):
    assert changes(rows) == []


@pytest.mark.parametrize(
    ("rates", "lifted", "warned"),
    [
        ((30.0, 60.0), True, True),
        ((29.97, 30.0), True, False),
        ((24.0, 30.0), True, False),
        ((60.0, 120.0), True, False),
        ((30.0, 60.0), False, False),
        ((30.0, None), True, False),
    ],
    ids=["two rates", "two clocks", "near", "both fast", "poses of files", "one frame"],
)
def test_a_subject_lifted_at_two_frame_rates_is_warned_of(rates, lifted, warned):
    rows = [
        {**row("a", visit, 1.0), "name": visit, "state": "done", "lifted": lifted, "fps": fps}
        for visit, fps in zip("12", rates, strict=True)
    ]
    rows.append({**rows[0], "subject": "b", "fps": 120.0})  # whom nobody compares with another
    assert (
        "The takes of 1 subject were lifted at 30 to 60 frames per second" in rates_within(rows)
    ) == warned
    assert bool(rates_within(rows)) == warned
    assert ("at 30 to 60 frames per second" in as_page("Study", rows, [])) == warned


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
    measures = {"walking": {"steps": 3, "right": {"x_s": 0.5}, "landings_s": [1.0], "reason": "none"}}
    device = {"asked": "auto", "networks": {"a.onnx": "cuda", "b.onnx": "cpu", "c.onnx": "cuda"}}
    of_run = {**SAID, "rows": None, "values": {}}
    run = made(measures=measures, notices=[of_run, {**of_run, "text": "a name \udcff"}], device=device)
    take = read_run(run).with_(measures=rows_of(measures))
    write_measures(take, run / "measures.csv")
    (found,) = figures(run)
    assert found["device"] == "cpu, cuda"
    assert found["numbers"] == {"walking.steps": 3.0, "walking.right.x_s": 0.5}
    assert isinstance(found["numbers"]["walking.steps"], float)
    assert {key: measure.unit for key, measure in found["measures"].items()} == {
        "walking.steps": "",
        "walking.right.x": "s",
    }
    assert [each["text"] for each in found["notices"]] == [SAID["text"], "a name ?"]
    assert not found["lifted"]
    assert (found["frames"], found["fps"], found["method"]) == (60, pytest.approx(30), "geometric")
    assert len(found["posture"]) == 17
    assert found["report"] == ""
    (run / "report.html").write_text("")
    assert figures(run)[0]["report"] == "takes/a/report.html"


def test_only_figures_that_say_something_are_compared(made):
    """No length without a scale, whatever it is called, nothing that others rest on or that is another figure too, and
    nothing that is of the recording alone."""
    figures = {
        "walking": {
            "frames": 60, "nan_share": 0.1, "cadence_spm": 100.0, "cadence_error_spm": 1.0, "walking_speed": 1.2,
            "walking_speed_error": 0.1, "landings_s": [1.0],
        },
        "off_keypoints": {"r_arm": {"p50_px": 3.0}},
        "symmetry": {"knee_flexion": {"right_deg": 49.0, "left_deg": 52.0, "symmetry_index_percent": -6.0}},
        "knee_bends": {"count": 2, "cycles": {"r_knee_flexion": {"count": 2, "mean_deg": [1.0] * 101}}},
    }  # fmt: skip
    usual = Measure("usual_error", 2.0, "deg", group=("range_of_motion", "r_knee_flexion"))
    take = read_run(made()).with_(measures=(Measure("reach", 0.8, "length"), usual, *rows_of(figures)))
    frame = take.need("poses").frame
    others = {"walking.cadence", "knee_bends.count", "symmetry.knee_flexion.symmetry_index"}
    assert set(_comparable(take)) == {*others, "reach", "walking.walking_speed"}  # metres
    without_scale = take.with_(poses=take.need("poses").with_(frame=frame.with_(unit="arbitrary")))
    assert set(_comparable(without_scale)) == others


def test_a_run_without_its_files_has_nothing_to_say(tmp_path):
    run = tmp_path / "takes" / "a"
    run.mkdir(parents=True)
    (found,) = figures(run)
    assert found["level_ok"] is found["frames"] is None
    assert found["measures"] == {}


@pytest.mark.parametrize(
    "summary",
    [{"measures": [1]}, {"poses": "x"}, {"notices": {"a": 1}}, {"poses": {"unit": 3}}],
    ids=["measures", "poses", "notices", "unit"],
)
def test_a_summary_that_somebody_has_changed_has_words(made, summary):
    with pytest.raises(InputError, match=r"finished.*remove that folder"):
        figures(made(**summary))
    run = made(batch={"key": ["x"], "files": 3})
    assert _kept(run).key == ""


@pytest.fixture
def entry(tmp_path) -> Entry:
    (tmp_path / "a.npy").write_bytes(b"some poses")
    return Entry("a", {"poses": (str(tmp_path / "a.npy"),), "fps": ("30",)}, ("poses",), {"subject": "s"})


def key(entry: Entry) -> str:
    return _key(entry, _hashes(entry, {}))


def test_a_take_is_another_one_when_its_content_its_options_or_a_version_changes(
    entry, tmp_path, monkeypatch
):
    first = key(entry)
    assert key(replace(entry, name="b", labels={"subject": "t"})) == first
    assert key(replace(entry, options={**entry.options, "fps": ("25",)})) != first
    (tmp_path / "elsewhere").mkdir()
    moved = (tmp_path / "a.npy").rename(tmp_path / "elsewhere" / "a.npy")
    entry = replace(entry, options={**entry.options, "poses": (str(moved),)})
    assert key(entry) == first
    moved.write_bytes(b"other poses")
    assert key(entry) != first
    moved.write_bytes(b"some poses")
    assert key(entry) == first
    known = dict(registry.registered("stages"))
    monkeypatch.setattr(registry, "entry_points", lambda group: ())
    assert known
    assert key(entry) != first


@pytest.mark.parametrize(
    ("stage", "named"), [("rectify", 'rectifier = "m.onnx"'), ("calibrate", 'camera_file = "camera.toml"')]
)
def test_a_file_that_a_recipe_names_counts_too(entry, tmp_path, monkeypatch, stage, named):
    monkeypatch.chdir(tmp_path)
    file, recipe = tmp_path / named.split('"')[1], tmp_path / "r.toml"
    file.write_bytes(b"one")
    recipe.write_text(f'[[stages]]\nuse = "{stage}"\n{named}\n')
    options = {**entry.options, "recipe": (str(recipe),)}
    entry = replace(entry, options=options, files=("poses", "recipe"))
    first = key(entry)
    file.write_bytes(b"two")
    assert key(entry) != first


def test_an_unchanged_file_is_not_read_again(entry, monkeypatch):
    known = _hashes(entry, {})
    monkeypatch.setattr("pcnet3d.stages.study.batch.take.sha256", lambda path: np.nan)
    assert _hashes(entry, known) == known
