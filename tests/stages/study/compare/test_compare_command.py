"""`pcnet3d compare` from runs to table, page and recording: the walker from two cameras, and against its truth; figures
of agreement by known answers."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import commands
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.rotations import turn_deg, turned
from pcnet3d.pipeline.signals.angles import ANGLES, OF_BOTH, near
from pcnet3d.stages.study.compare.align import agreement, correlated, correlation, size_ratio
from pcnet3d.stages.study.compare.command import compare
from pcnet3d.stages.study.compare.comparison import as_page, compared
from pcnet3d.stages.study.compare.side import load_side
from refusals import refused

LATE_S = 0.5


@pytest.fixture(scope="module")
def cameras(runs) -> dict:
    compare([runs / "side", runs / "front"], align="correlate")
    return json.loads((runs / "side/compare/compare.json").read_text())


@pytest.fixture(scope="module")
def against_truth(runs) -> dict:
    """Motion capture at 120 a second that was started half a second later."""
    world = walker(fps=120).world[int(120 * LATE_S) :]
    np.savez(runs / "truth.npz", joints=world, joint_names=H36M17.joints, fps=120.0)
    compare([runs / "side"], truth=runs / "truth.npz", output=runs / "truth")
    return json.loads((runs / "truth/compare.json").read_text())


def test_two_cameras_give_the_same_angles(cameras):
    pair = cameras["pairs"]["front"]
    assert pair["alignment"]["shift_s"] == pytest.approx(0, abs=2e-3)
    assert set(pair["angles"]) == set(ANGLES)
    for name, angle in ANGLES.items():
        assert pair["angles"][name]["rmse_deg"] < (3.0 if angle.needs_gravity else 0.1), name
    assert abs(pair["turn_deg"]) < 10
    assert pair["joints_mm"] < 40


@pytest.mark.parametrize("lacks", ["head", "arms"])
def test_motion_capture_of_part_of_the_joints_is_compared_in_what_both_have(
    runs, against_truth, tmp_path, lacks
):
    world = np.load(runs / "truth.npz")["joints"]
    parts = (
        ("hip", "knee", "ankle")
        if lacks == "arms"
        else ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    )
    names = [f"{side}_{part}" for side in "rl" for part in parts]
    np.savez(tmp_path / "x.npz", joints=world[:, H36M17.indices(names)], joint_names=names, fps=120.0)
    compare([runs / "side"], truth=tmp_path / "x.npz", output=tmp_path / "out")
    found = json.loads((tmp_path / "out/compare.json").read_text())
    pair, whole = found["pairs"]["side"], against_truth["pairs"]["side"]
    assert pair["alignment"]["shift_s"] == pytest.approx(whole["alignment"]["shift_s"], abs=0.02)
    codes = [each["code"] for each in found["notices"]]
    assert "truth-lacks-joints" in codes
    legs = {f"{side}_{name}" for side in "rl" for name in ("knee_flexion", "hip_abduction")} | {
        "pelvis_obliquity"
    }
    assert set(pair["angles"]) == (set(whole["angles"]) if lacks == "head" else legs)
    for name in legs:
        assert pair["angles"][name]["rmse_deg"] == pytest.approx(whole["angles"][name]["rmse_deg"], abs=0.3)
    if lacks == "head":  # one trunk line in both, so no bias by definition
        assert abs(pair["angles"]["r_thigh_trunk_flexion"]["bias_deg"]) < 3


def test_motion_capture_of_another_clock_and_rate(against_truth):
    pair = against_truth["pairs"]["side"]
    assert against_truth["reference"] == "motion capture"
    assert pair["alignment"]["how"] == "cross-correlation"
    assert pair["alignment"]["shift_s"] == pytest.approx(-LATE_S, abs=0.005)
    for name, angle in ANGLES.items():
        assert pair["angles"][name]["rmse_deg"] < (3.0 if angle.needs_gravity else 0.5), name
    assert abs(pair["turn_deg"]) < 10  # both in LEVEL, whose heading is the take's
    assert pair["joints_mm"] < 40


def test_the_page_is_one_table_of_differences_then_charts(cameras, against_truth, runs):
    for folder, name in ((runs / "side/compare", "front"), (runs / "truth", "side")):
        assert {f.name for f in folder.iterdir()} == {"compare.html", "compare.json", "summary.json"}
        page = (folder / "compare.html").read_text()
        head, *sections = page.split("<section")
        assert f"of {name} and" in head
        names = re.findall(r"<h2>([^<]+)</h2>", page)
        assert names == ["Differences", "Angles over time", "How they were aligned"]
        shown = dict(zip(names, sections, strict=True))
        assert shown["Differences"].count("<table") == 1
        assert shown["Differences"].count("<tr") > len(ANGLES)
        rows = shown["Angles over time"].split('<div class="charts">')[1:]
        assert len(rows) == len(OF_BOTH)
        assert page.count("<script") == 1  # reads off the charts
        assert len(page) < 10e6
    assert "compare" in json.loads((runs / "side/summary.json").read_text())["files"]


def test_runs_of_different_filters_and_rates_say_so(sides):
    filters = zip(sides[:2], (None, 6.0), strict=True)
    shown = as_page(compared([replace(side, name=f"run {hz}", cutoff_hz=hz) for side, hz in filters]))
    assert "low-pass of the joints: unfiltered and 6 Hz" in shown
    assert "30 a second" in shown


@pytest.mark.parametrize(("late_s", "search_s"), [(-1.7, 5.0), (0.0123, 5.0), (2.4, 5.0), (0.0, 0.0)])
def test_a_shift_is_found_to_a_fraction_of_a_frame(sides, late_s, search_s):
    moved = replace(sides[1], time_s=sides[1].time_s + late_s)
    assert correlated(moved, sides[0], 0.0, search_s).shift_s == pytest.approx(-late_s, abs=2e-3)


def test_a_short_take_whose_arms_nobody_saw_is_its_own_match(sides):
    rows = slice(56)  # 1.87 s, of which 1 s has to be known
    legs = {
        name: np.where("elbow" in name or "shoulder" in name, np.nan, values[rows])
        for name, values in sides[0].angles.items()
    }
    short = replace(sides[0], time_s=sides[0].time_s[rows], angles=legs)
    found = correlated(short, short, 0.0, 1.0)
    assert (found.shift_s, found.r) == (pytest.approx(0, abs=2e-3), pytest.approx(1))
    unseen = replace(short, angles={name: values + np.nan for name, values in legs.items()})
    with pytest.raises(InputError, match="of motion in both"):
        correlated(unseen, short, 0.0, 1.0)


def test_circles_of_an_arm_are_resampled_without_the_steps_of_their_range(sides):
    circling = near(180 * sides[0].time_s, ANGLES["r_shoulder_flexion"].centre_deg)
    side = replace(sides[0], angles={**sides[0].angles, "r_shoulder_flexion": circling})
    between_s = (side.time_s[1:] + side.time_s[:-1]) / 2
    found = side.at("r_shoulder_flexion", between_s)
    known = np.isfinite(found)
    assert known.mean() > 0.9
    assert np.abs(near(found - 180 * between_s, 0.0))[known].max() < 1e-3
    assert np.abs(found[known] - ANGLES["r_shoulder_flexion"].centre_deg).max() <= 180


def test_heading_and_size_are_found(sides):
    joints = sides[0].level
    assert turn_deg(joints, turned(joints, 75.0)) == pytest.approx(75)
    assert size_ratio(joints, 3 * joints) == pytest.approx(3)


def test_bad_input_has_words(runs, sides, tmp_path):
    with pytest.raises(InputError, match="two or more"):
        compare([runs / "side"])
    with pytest.raises(InputError, match="finished"):
        compare([runs / "side", tmp_path])
    with pytest.raises(InputError, match="--truth"):
        compare([runs / "side", runs / "front"], unit="mm")
    with refused("cannot-open"):
        compare([runs / "side"], truth=Path("nothing.trc"))
    for figure in ("nan", "inf"):
        commands.refused(
            commands.pcnet3d("compare", runs / "side", runs / "front", "--offset", figure), figure
        )
    for align in ("stamps", "correlate"):
        with pytest.raises(InputError, match="--offset"):
            compare([runs / "side", runs / "front"], align=align, offset=100.0)
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="did not make"):
        compare([runs / "side", runs / "front"], output=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("value", [0, -3, "nan"])
def test_a_figure_that_cannot_be_is_blamed_and_not_the_file(runs, tmp_path, value):
    words = ["compare", runs / "side", "-o", tmp_path / "out", "--truth", runs / "front/markers.trc"]
    commands.refused(commands.pcnet3d(*words, "--rate", value), "--rate", f"got {value}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("first", [True, False])
def test_a_run_without_an_angle_is_compared_in_the_others(runs, sides, tmp_path, first):
    older = tmp_path / "older"
    shutil.copytree(runs / "side", older)
    table = pq.read_table(older / "kinematics.parquet")
    lacking = [name for name in table.column_names if name.startswith("pelvis_obliquity")]
    pq.write_table(table.drop_columns(lacking), older / "kinematics.parquet")
    pair = [load_side(older), sides[1]]
    found = compared(pair if first else pair[::-1], "stamps")
    assert set(found.pairs[0].agreement) == set(ANGLES) - {"pelvis_obliquity"}


REFERENCE = 40 + 30 * np.sin(np.linspace(0, 20, 2000))


def test_an_angle_that_is_read_too_large_and_off():
    found = agreement(1.2 * REFERENCE + 3.0, REFERENCE)
    off = 0.2 * REFERENCE + 3.0
    assert found["bias_deg"] == pytest.approx(off.mean())
    assert found["sd_deg"] == pytest.approx(off.std(ddof=1))
    assert found["rmse_deg"] == pytest.approx(np.sqrt((off**2).mean()))
    assert found["rom_deg"] == pytest.approx(1.2 * found["rom_reference_deg"])
    assert found["r"] == pytest.approx(1)


def test_a_difference_across_the_end_of_the_circle_is_small():
    assert agreement(np.full(20, 179.0), np.full(20, -179.0))["bias_deg"] == pytest.approx(-2)


def test_right_errors_hold_nine_tenths():
    off = np.random.default_rng(1).normal(0, 4.0, len(REFERENCE))
    found = agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), 4.0))
    assert found["within_band"] == pytest.approx(0.9, abs=0.02)
    assert "within_band" not in agreement(REFERENCE + off, REFERENCE, np.full(len(REFERENCE), np.nan))


def test_missing_frames_are_left_out_and_too_few_give_nothing():
    values = REFERENCE.copy()
    values[9:] = np.nan
    assert agreement(values, REFERENCE) is None
    values[:100] = REFERENCE[:100]
    assert agreement(values, REFERENCE)["frames"] == 100


def test_what_hardly_changes_has_no_r():
    noise = np.random.default_rng(2).normal(0, 0.1, (2, 50))
    assert np.isnan(correlation(*noise, least=0.5))
    assert np.isfinite(correlation(*noise, least=0.01))
