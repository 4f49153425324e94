"""`pcnet3d compare` from runs to table, page and recording: the walker from two cameras, and against its truth."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from golden.measures import rows_of
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.angle_error.repeatability import shipped
from pcnet3d.models.common.metrics import SD_90
from pcnet3d.pipeline import H36M17, InputError, load_recipe
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.core.take import Session
from pcnet3d.pipeline.files.measures import read_measures
from pcnet3d.pipeline.reading.mocap.clip import Clip, read_mocap, write_mocap
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.pipeline.signals.angles import ANGLES, OF_BOTH, near
from pcnet3d.stages.drawing.words import errors_of_angles
from pcnet3d.stages.study.compare.align import correlated, size_ratio, turn_deg, turned
from pcnet3d.stages.study.compare.changes import changes, from_same_place, told
from pcnet3d.stages.study.compare.command import compare, compared
from pcnet3d.stages.study.compare.comparison import figures, result
from pcnet3d.stages.study.compare.cycles import spans
from pcnet3d.stages.study.compare.page import as_page
from pcnet3d.stages.study.compare.side import load_side, named_apart, one_clock
from pcnet3d.stages.study.compare.wrists import limbs_of
from refusals import refused

LATE_S = 0.5


@pytest.fixture(scope="module")
def sides(runs):
    return [load_side(runs / name) for name in ("side", "front")]


@pytest.fixture(scope="module")
def cameras(runs) -> dict:
    compare([runs / "side", runs / "front"])
    return json.loads((runs / "side/compare/compare.json").read_text())


def test_where_the_rectifier_computed_is_recorded(against_truth):
    assert against_truth["device"] == {"asked": "auto", "networks": {"pcnet.onnx": "cpu"}, "notes": []}


@pytest.fixture(scope="module")
def against_truth(runs) -> dict:
    """Motion capture at 120 a second that was started half a second later."""
    world = walker(fps=120).world.astype(np.float32)[int(120 * LATE_S) :]
    write_mocap(runs / "truth.npz", [Clip("a_1", "a", "asfamc", 120.0, world)])
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


def test_view_consistency_is_what_rectification_gives(cameras):
    spread, without = cameras["view_spread_deg"], cameras["view_spread_unrectified_deg"]
    assert set(without) == {name for name, angle in ANGLES.items() if angle.needs_gravity}
    assert spread["trunk_lean_sagittal"] < 0.5 * without["trunk_lean_sagittal"]
    assert spread["r_knee_flexion"] < 0.1


def test_cycles_are_cut_at_the_same_moments(cameras, sides):
    raises = [c for c in cameras["pairs"]["front"]["cycles"] if c["kind"] == "arm raises"]
    assert {c["angle"] for c in raises} >= {"r_shoulder_elevation", "l_shoulder_elevation"}
    for cycle in raises:
        assert cycle["difference_deg"] < 0.2
        assert cycle["lower_deg"] <= 0.1
        assert cycle["upper_deg"] >= -0.1
    cut = spans(sides[0].measures)["arm raises", "r_shoulder_elevation"]
    assert (cut[:, 1] > cut[:, 0]).all()


@pytest.mark.parametrize("lacks", ["head", "arms"])
def test_motion_capture_of_part_of_the_joints_is_compared_in_what_both_have(
    runs, against_truth, tmp_path, lacks
):
    clip = read_mocap(runs / "truth.npz")[0]
    parts = (
        ("hip", "knee", "ankle")
        if lacks == "arms"
        else ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    )
    names = [f"{side}_{part}" for side in "rl" for part in parts]
    np.savez(
        tmp_path / "x.npz", joints=clip.joints[:, H36M17.indices(names)], joint_names=names, fps=clip.fps
    )
    compare([runs / "side"], truth=tmp_path / "x.npz", output=tmp_path / "out")
    found = json.loads((tmp_path / "out/compare.json").read_text())
    pair, whole = found["pairs"]["side"], against_truth["pairs"]["side"]
    assert pair["alignment"]["shift_s"] == pytest.approx(whole["alignment"]["shift_s"], abs=0.02)
    codes = [each["code"] for each in found["notices"]]
    assert "truth-lacks-joints" in codes
    assert ("truth-trunk-by-shoulders" in codes) == (lacks == "head")
    legs = {f"{side}_{name}" for side in "rl" for name in ("knee_flexion", "hip_abduction")} | {
        "pelvis_obliquity"
    }
    assert set(pair["angles"]) == (set(whole["angles"]) if lacks == "head" else legs)
    for name in legs:
        assert pair["angles"][name]["rmse_deg"] == pytest.approx(whole["angles"][name]["rmse_deg"], abs=0.3)
    if lacks == "head":  # one trunk line in both, so no bias by definition
        assert abs(pair["angles"]["r_thigh_trunk_flexion"]["bias_deg"]) < 3
    assert (pair["wrists"] is None) == (lacks == "arms")


def test_motion_capture_of_another_clock_and_rate(against_truth):
    pair = against_truth["pairs"]["side"]
    assert against_truth["reference"] == "motion capture"
    assert pair["alignment"]["how"] == "cross-correlation"
    assert pair["alignment"]["shift_s"] == pytest.approx(-LATE_S, abs=0.005)
    for name, angle in ANGLES.items():
        assert pair["angles"][name]["rmse_deg"] < (3.0 if angle.needs_gravity else 0.5), name
    assert abs(pair["turn_deg"]) < 10  # both in LEVEL, whose heading is the take's
    assert pair["joints_mm"] < 40
    assert max(of["rms_mm"] for of in pair["joints"].values()) < 80
    assert len(pair["joints"]) == 16


def test_the_wrist_figure_tells_the_methods_apart(against_truth):
    methods = against_truth["pairs"]["side"]["wrists"]["methods"]
    assert list(methods) == [
        "raw 2D", "camera axes", "geometric per frame", "pcnet per frame", "pcnet, take"
    ]  # fmt: skip
    for wrist in ("r_wrist", "l_wrist"):
        take = methods["pcnet, take"][wrist]
        assert take["back"]["r"] > 0.99
        assert take["up"]["r"] > 0.99
        assert take["up"]["rmse_mm"] < 40
        size = against_truth["pairs"]["side"]["wrists"]["size_m"]
        assert take["up"]["rmse_mm"] == pytest.approx(1000 * size * take["up"]["rmse"])
        for other in ("camera axes", "geometric per frame"):
            assert take["back"]["rmse"] < 0.5 * methods[other][wrist]["back"]["rmse"]
        assert "back" not in methods["raw 2D"][wrist]
        assert methods["raw 2D"][wrist]["up"]["r"] > 0.9


def test_the_keypoints_are_those_of_the_run(sides, walk):
    from pcnet3d.examples.walker.camera import side_camera
    from pcnet3d.pipeline import H36M17

    pixels = limbs_of(sides[0].run)
    truth = side_camera(walk).project(walk.world)[:, H36M17.index("l_wrist")]
    assert pixels.shape == (len(walk), 12, 2)
    assert np.linalg.norm(pixels[:, 11] - truth, axis=-1).max() < 4
    assert limbs_of(sides[0].run.with_(keypoints=None)) is None


def test_files_and_page(cameras, against_truth, runs):
    assert {f.name for f in (runs / "truth").iterdir()} == {
        "compare.html", "compare.json", "compare.rrd", "summary.json",
    }  # fmt: skip
    assert "compare" in json.loads((runs / "side/summary.json").read_text())["files"]
    page = (runs / "truth/compare.html").read_text()
    for words in (
        "Wrists against motion capture",
        "Agreement of the angles",
        "Agreement of the joints",
        "Cycles",
        "raw 2D, right wrist",
    ):
        assert words in page
    assert page.count("<script") == 1  # reads off the charts
    assert len(page) < 10e6


def test_the_page_of_two_runs_begins_with_what_came_of_it(cameras, runs):
    page = (runs / "side/compare/compare.html").read_text()
    head, *sections = page.split("<section")
    assert "front against side: taken for one motion" in head
    names = [re.search(r"<h2>([^<]+)</h2>", section).group(1) for section in sections]
    assert names == [
        "At the same moments", "Ranges of motion", "Walking and repetitions", "Agreement of the angles",
        "Agreement of the joints", "Cycles",
        "Angles over time and differences", "Wrist paths and accelerations", "How they were brought together",
    ]  # fmt: skip
    shown = dict(zip(names, sections, strict=True))
    assert shown["At the same moments"].count('class="skeleton"') == 6
    rows = shown["Angles over time and differences"].split('<div class="charts">')[1:]
    assert len(rows) == len(OF_BOTH)
    titles = [re.findall(r"<figcaption>([^<]+)</figcaption>", row) for row in rows]
    assert ["Right knee flexion (°)", "Left knee flexion (°)", "Knee flexion: difference (°)"] in titles
    assert ["Trunk lean forward (°)", "Trunk lean forward: difference (°)"] in titles
    motion = shown["Wrist paths and accelerations"]
    assert motion.count('class="plane"') == 3
    assert motion.index("Right wrist acceleration (m/s²)") < motion.index("Left wrist acceleration (m/s²)")


def test_wrist_paths_are_from_the_front_only_where_the_heading_is_the_persons(sides):
    reference, side = sides
    assert "<figcaption>From the front (m)</figcaption>" in as_page(compared([reference, side]))
    shared = with_run(
        reference, rectified=replace(reference.run.rectified, level_heading="camera")
    )  # with another person
    said = as_page(compared([shared, side]))
    assert "From the front" not in said
    assert "<figcaption>From the camera&#39;s side (m)</figcaption>" in said


def test_two_cameras_give_the_same_accelerations(cameras, sides):
    found = cameras["pairs"]["front"]["accelerations"]
    assert list(found) == ["r_wrist", "l_wrist", "r_ankle", "l_ankle"]
    assert min(of["r"] for of in found.values()) > 0.9
    twin = replace(sides[0], name="twin", acceleration={"r_wrist": 2 * sides[0].acceleration["r_wrist"]})
    (pair,) = compared([sides[0], twin]).pairs
    own = sides[0].acceleration["r_wrist"]
    assert pair.accelerations.agreement["r_wrist"]["rmse"] == pytest.approx(np.sqrt(np.nanmean(own**2)))
    assert list(pair.accelerations.agreement) == ["r_wrist"]


def test_the_band_of_a_chart_holds_as_many_frames_as_the_table_says(sides):
    (pair,) = compared(sides).pairs
    for name, of in pair.agreement.items():
        off = near(pair.side.angles[name] - pair.at_reference[name], 0.0)
        stated = np.isfinite(off) & np.isfinite(pair.sd[name])
        if "within_band" in of:
            inside = np.abs(off[stated]) <= SD_90 * pair.sd[name][stated]
            assert inside.mean() == pytest.approx(of["within_band"])


def test_the_recording_has_both_skeletons_on_one_clock(cameras, runs, sides):
    from rerun.chunk import RrdReader

    batches = {
        chunk.entity_path: chunk.to_record_batch()
        for chunk in RrdReader(runs / "side/compare/compare.rrd").stream().to_chunks()
        if not chunk.is_static
    }
    both = [batches[f"/level/{i}/joints"] for i in (0, 1)]
    first, second = (np.array(b.column("Points3D:positions").to_pylist(), dtype=float) for b in both)
    assert first.shape == (240, 17, 3)
    np.testing.assert_allclose(first, sides[0].level, atol=1e-4)
    assert np.linalg.norm(first - second, axis=-1).mean() < 0.04
    knees = [
        np.ravel(batches[f"/angles/r_knee_flexion/{i}"].column("Scalars:scalars").to_pylist()) for i in (0, 1)
    ]
    np.testing.assert_allclose(*(np.array(k, dtype=float) for k in knees), atol=0.2)


def test_runs_of_one_recording_keep_their_stamps(sides):
    twin = replace(sides[0], name="twin", time_s=sides[0].time_s + 0.0)
    found = compared([sides[0], twin])
    assert found.pairs[0].alignment.how == "time stamps"
    assert found.pairs[0].alignment.shift_s == 0
    assert found.pairs[0].agreement["r_knee_flexion"]["rmse_deg"] < 1e-6


def with_run(side, **changes):
    """The side of a run with other values in these fields of its take."""
    return replace(side, run=side.run.with_(**changes))


@pytest.mark.parametrize("late_s", [-1.7, 0.0123, 2.4])
def test_a_shift_is_found_to_a_fraction_of_a_frame(sides, late_s):
    moved = replace(sides[1], time_s=sides[1].time_s + late_s)
    assert correlated(moved, sides[0], 0.0, 5.0).shift_s == pytest.approx(-late_s, abs=2e-3)


def test_a_search_of_nothing_finds_a_shift_of_nothing(sides):
    assert correlated(sides[1], sides[0], 0.0, 0.0).shift_s == pytest.approx(0, abs=2e-3)


def test_takes_of_different_motions_have_their_cycles_compared(sides):
    rng = np.random.default_rng(0)
    other = {name: rng.normal(0, 20, len(values)) for name, values in sides[1].angles.items()}
    found = compared([sides[0], replace(sides[1], angles=other)])
    assert found.pairs[0].alignment is None
    assert found.pairs[0].agreement == {}
    assert [each.code for each in found.notices] == ["angles-apart"]
    still = {name: np.zeros(len(values)) for name, values in other.items()}
    nothing = compared([sides[0], replace(with_run(sides[1], measures=None), angles=still)], align="cycles")
    assert next(result(nothing.pairs[0])).endswith("compared: nothing")
    visits = compared(sides, align="cycles").pairs[0]
    assert re.search(r"compared: \d kinds? of cycle$", next(result(visits)))
    assert visits.agreement == {}
    assert max(c.agreement["difference_deg"] for c in visits.cycles if c.kind == "arm raises") < 0.5


def walking(side, stride_s, **session):
    """The side as a walk of even strides, and what was said about its recording."""
    phase = 2 * np.pi * side.time_s / stride_s
    swings = {name: 30 * np.sin(phase + np.pi * name.startswith("l_")) for name in side.angles}
    return replace(with_run(side, session=Session(**session)), angles=swings)


@pytest.mark.parametrize("key", ["date", "person_id"])
def test_what_the_user_says_of_two_visits_makes_them_two_motions(sides, key):
    visits = [walking(sides[0], 1.0, **{key: "2026-03-02"}), walking(sides[1], 1.05, **{key: "2026-05-04"})]
    found = compared(visits, search_s=0.4)  # of less than a stride, so that no other shift fits
    (pair,) = found.pairs
    assert (pair.alignment, pair.agreement, found.spread) == (None, {}, {})
    assert found.notices[0].code == "told-apart"
    assert found.notices[0].values["what"] == {"date": "dates", "person_id": "people"}[key]
    assert next(result(pair)).startswith("front against side: taken for two motions")
    assert compared(visits, "correlate", search_s=0.4).pairs[0].alignment is not None
    one_day = [with_run(each, session=visits[0].session) for each in visits]
    assert compared(one_day, search_s=0.4).pairs[0].alignment is not None


def test_walks_that_fit_at_every_stride_are_compared_moment_by_moment_on_demand_only(sides):
    """Two people's as well as one's before two cameras: nothing tells which stride is which."""
    for stride_s in (1.0, 1.05):
        walks = [walking(sides[0], 1.0), walking(sides[1], stride_s)]
        found = compared(walks)
        assert found.pairs[0].alignment is None
        assert [each.code for each in found.notices] == ["shift-unknown"]
        (pair,) = compared(walks, search_s=0.4).pairs
        said = next(result(pair))
        assert said.startswith("front against side: taken for one motion, shifted by")
        assert said.endswith("; if they are two takes, say --align cycles")
        assert compared(walks, "correlate").pairs[0].alignment is not None


def test_walks_of_other_cadences_are_two_motions(walk, tmp_path):
    """The walker against himself at four fifths of the tempo: their angles go together, by chance, for four seconds."""
    np.save(tmp_path / "walk.npy", camera_poses(walk, side_camera(walk)).joints[:120])
    recipe = Recipe(stages=tuple(one for one in load_recipe().stages if one.use not in ("record", "report")))
    for fps in (30, 24):
        sources = RunOptions(poses=tmp_path / "walk.npy", adapter="videopose3d", fps=fps)
        run_files(sources, tmp_path / f"{fps}", recipe)
    usual, slow = (load_side(tmp_path / name) for name in ("30", "24"))
    found = compared([usual, slow])
    assert found.pairs[0].alignment is None
    (said,) = found.notices
    assert (said.code, said.values) == ("told-apart", {"run": "24", "other": "30", "what": "cadences"})
    silent = [with_run(side, measures=None) for side in (usual, slow)]
    for found in (compared([usual, slow], "correlate"), compared(silent)):
        assert found.pairs[0].alignment.r > 0.5
        assert found.notices[0].code == "angles-unusual"


def test_of_strides_that_fit_as_well_the_nearest_to_the_offset_is_taken(sides):
    """A walk whose first stride was lifted badly fits best where that stride lies outside of the other."""
    walk = walking(sides[0], 1.0)
    noise = np.random.default_rng(0).normal(0, 10, len(walk.time_s)) * (walk.time_s < 1)
    lifted = replace(
        walk, name="lifted", angles={name: values + noise for name, values in walk.angles.items()}
    )
    for offset_s in (0.0, 0.2, 1.0):
        found = correlated(lifted, walk, offset_s, 5.0)
        assert found.shift_s == pytest.approx(round(offset_s), abs=5e-3)
        assert found.runner_up > found.r
    (said,) = compared([walk, lifted], "correlate").notices
    assert (said.code, said.values["offset_s"]) == ("shift-ambiguous", 0.0)


def test_what_hardly_correlates_is_not_said_to_be_one_motion(sides):
    rng = np.random.default_rng(0)
    other = {name: rng.normal(0, 20, len(values)) for name, values in sides[1].angles.items()}
    twin = replace(sides[0], angles=other)  # of the same recording
    for pair in (sides[0], replace(sides[1], angles=other)), (sides[0], twin):
        (found,) = compared(list(pair), "stamps").pairs
        assert "taken for one motion though their angles hardly correlate" in next(result(found))
    assert "side: one motion, shifted by +0.000 s" in next(result(compared([sides[0]] * 2).pairs[0]))


def test_the_session_of_a_run_is_known_to_its_side(runs, tmp_path):
    shutil.copytree(runs / "front", tmp_path / "later")
    summary = json.loads((tmp_path / "later/summary.json").read_text())
    summary["session"] = {"date": "2026-05-04"}
    (tmp_path / "later/summary.json").write_text(json.dumps(summary))
    assert load_side(tmp_path / "later").session == Session(date="2026-05-04")
    assert load_side(runs / "front").session == Session()


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
    with pytest.raises(InputError, match="both know"):
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


def test_no_stride_reaches_across_a_turn_between_two_walks(runs):
    """Of one who walks there and back the feet land on both sides of the turn within three seconds."""
    measures = nested(read_measures(runs / "side"))
    measures["walking"]["right"] |= {
        "landings_s": [0.0, 1.1, 3.3, 4.4],
        "stride_start_s": [0.0, 3.3],
        "stride_stop_s": [1.1, 4.4],
    }
    cut = spans(rows_of(measures))["strides", "r_knee_flexion"]
    np.testing.assert_array_equal(cut, [[0.0, 1.1], [3.3, 4.4]])


def of_visit(side, low_deg, high_deg, speed):
    """The side as a take with one range of motion, known to 4 degrees, and one walking speed, known to 0.05 m/s."""
    ranges = {"r_knee_flexion": {"p05_deg": low_deg, "p95_deg": high_deg, "p05_p95_deg": high_deg - low_deg}}
    ranges["r_knee_flexion"] |= {"p05_p95_error_deg": 4.0, "sd_deg": 3.0}
    walking = {"walking_speed": speed, "walking_speed_error": 0.05, "steps": 4}
    measures = rows_of({"range_of_motion": ranges, "walking": walking})
    return replace(with_run(side, measures=measures), metric=True)


def test_a_difference_of_two_visits_stands_with_its_error(sides):
    visits = [of_visit(sides[0], 5.0, 55.0, 1.0), of_visit(sides[1], 5.0, 75.0, 1.1)]
    found = compared(visits)
    knee, speed = found.pairs[0].changes
    assert (knee.item, knee.by, knee.error) == ("r_knee_flexion", 20.0, pytest.approx(np.hypot(4, 4)))
    assert not knee.within_error  # 20 of 1.645 * 5.7
    assert speed.within_error  # 0.10 of 1.645 * 0.071
    said = list(result(found.pairs[0]))[-1]
    assert said == (
        "1 of 2 ranges of motion and figures of movements differs by more than the error, front less side: range of "
        "right knee flexion +20 ± 9.3°; 1 beyond MDC90, where 0.2 are expected by chance"
    )
    page = as_page(found)
    assert 'data-label="right: difference (± MDC90)">+20 ± 9.3 *</td>' in page
    assert "different places" in page
    assert re.search(r"<td[^>]*class=soft[^>]*>\+0\.10 ± 0\.12</td>", page)
    (entry,) = (one for one in figures(found)["pairs"]["front"]["changes"] if one["unit"] == "m/s")
    assert (entry["reference"], entry["value"], entry["within_error"]) == (1.0, 1.1, True)
    assert (entry["mdc90"], entry["differs"]) == (pytest.approx(0.12, abs=0.01), False)
    assert figures(found)["pairs"]["front"]["same_place"] is False


def lifted(side, by=None):
    """The side as of poses that the built-in lifter made, or another."""
    made_by = MadeBy("estimated", shipped_noise().lifter if by is None else by, in_run=True)
    return with_run(side, poses=side.run.poses.with_(made_by=made_by), angle_errors="judged")


def test_what_the_lifter_errs_alike_in_both_visits_is_not_in_the_difference(sides):
    """Differences of two visits were stated three times too large: 23 degrees of a knee's range where 8 do."""
    first, later = (of_visit(lifted(sides[0]), 5.0, high, 1.0) for high in (55.0, 65.0))
    later = replace(later, name="later")
    knee = changes(later, first, True)[0]
    assert knee.error == pytest.approx(
        shipped()["factors"]["again"]["range_of_motion.knee_flexion"] * np.hypot(4, 4)
    )
    assert not knee.within_error
    assert changes(later, first, False)[0].error > knee.error
    of_another = with_run(later, poses=lifted(later, "another").run.poses)
    assert changes(of_another, first, True)[0].error == pytest.approx(np.hypot(4, 4))
    of_file = with_run(later, angle_errors="file")  # shares of other errors than these
    assert changes(of_file, first, True)[0].error == pytest.approx(np.hypot(4, 4))
    page = as_page(compared([of_file, first], "cycles"))
    assert all(errors_of_angles(how) in page for how in ("judged", "file"))
    assert from_same_place(later, first)
    assert "about the same place" in as_page(compared([first, later], "cycles"))


def test_of_many_figures_one_that_chance_may_have_made_is_not_said_to_differ(sides):
    """By Benjamini and Hochberg: nine figures that are alike, and one beyond its own MDC90."""

    def visit(side, more_deg):
        ranges = {
            name: {"p05_p95_deg": 50.0 + more_deg * (name == "r_knee_flexion"), "p05_p95_error_deg": 4.0}
            for name in list(ANGLES)[:10]
        }
        return with_run(side, measures=rows_of({"range_of_motion": ranges}))

    assert "r_knee_flexion" in list(ANGLES)[:10]
    for more_deg, beyond, differ in ((5.0, 0, 0), (11.0, 1, 0), (40.0, 1, 1)):
        found = changes(visit(sides[1], more_deg), visit(sides[0], 0.0), True)
        assert len(found) == 10
        assert sum(not change.within_error for change in found) == beyond
        assert sum(change.differs for change in found) == differ
        (said,) = told(found, "front less side")
        assert said.startswith(("1 of 10", "None of 10")[not differ])
        assert said.endswith(f"{beyond or 'none'} beyond MDC90, where 1 are expected by chance")


def test_visits_that_are_alike_differ_in_nothing(sides):
    visits = [of_visit(side, 5.0, 55.0, 1.0) for side in sides]
    assert list(result(compared(visits).pairs[0]))[-1].startswith("None of 2 ranges")
    unknown = replace(visits[1], metric=False)  # whose lengths are in a unit of its own
    assert [change.item for change in compared([visits[0], unknown]).pairs[0].changes] == ["r_knee_flexion"]


def test_estimators_of_one_recording_are_no_visits(sides):
    """Their errors are not independent, so nothing is said of changes."""
    visits = [of_visit(sides[0], 5.0, 55.0, 1.0), replace(of_visit(sides[0], 5.0, 75.0, 1.0), name="twin")]
    assert not any("ranges of motion" in said for said in result(compared(visits).pairs[0]))


def test_takes_that_have_a_part_in_common_are_said_to_differ_for_that(sides):
    """Ranges of motion are of whole takes; those of a cut were said to be smaller by more than their errors."""
    first, other = (of_visit(side, 5.0, 55.0, 1.0) for side in sides)
    for late_s, warned in ((0.0, False), (0.4, False), (3.0, True)):  # of 8 s
        later = replace(other, time_s=other.time_s + late_s)
        for pair in ([first, later], [later, first]):
            said = [each for each in compared(pair, "stamps").notices if each.code == "partly-common"]
            assert len(said) == warned
            assert all(
                (each.values["common_s"], each.values["longest_s"])
                == (pytest.approx(5, abs=0.05), pytest.approx(8, abs=0.05))
                for each in said
            )
    assert not any(each.code == "partly-common" for each in compared([first, later], "cycles").notices)


def test_lifted_runs_of_different_frame_rates_are_warned_of(sides):
    visits = [sides[0], replace(sides[1], time_s=2 * sides[1].time_s)]
    assert not compared(visits, "cycles").notices  # poses of files
    lifted = [
        with_run(side, poses=side.run.poses.with_(made_by=MadeBy("estimated", "l", in_run=True)))
        for side in visits
    ]
    (said,) = compared(lifted, "cycles").notices
    assert said.code == "rates-differ"
    assert said.text.startswith("The runs were lifted at 15 to 30 frames per second")
    alike = [replace(side, time_s=sides[0].time_s) for side in lifted]
    assert not compared(alike, "cycles").notices


def test_parts_of_one_recording_that_share_no_time_are_two_takes(sides):
    later = replace(sides[0], name="later", time_s=sides[0].time_s + 100.0)
    assert not one_clock(later, sides[0])
    found = compared([sides[0], later])
    assert found.pairs[0].alignment is None
    assert [each.code for each in found.notices] == ["no-common-time"]
    assert one_clock(replace(later, time_s=sides[0].time_s + 3.0), sides[0])


def test_a_folder_may_be_called_as_an_address_is(runs, tmp_path, monkeypatch):
    shutil.copytree(runs / "side", tmp_path / "part0:3")
    monkeypatch.chdir(tmp_path)
    assert load_side(Path("part0:3")).name == "part0:3"


def test_heading_and_size_are_found(sides):
    joints = sides[0].level
    assert turn_deg(joints, turned(joints, 75.0)) == pytest.approx(75)
    assert size_ratio(joints, 3 * joints) == pytest.approx(3)


def test_names_that_are_alike_are_told_apart(sides):
    assert [s.name for s in named_apart([sides[0], sides[0], sides[1]])] == ["side (1)", "side (2)", "front"]


def test_bad_input_has_words(runs, sides, tmp_path):
    with pytest.raises(InputError, match="two to 6"):
        compare([runs / "side"])
    with pytest.raises(InputError, match="finished"):
        compare([runs / "side", tmp_path])
    with pytest.raises(InputError, match="--truth"):
        compare([runs / "side", runs / "front"], clip="a_1")
    with refused("cannot-open"):
        compare([runs / "side"], truth=Path("nothing.trc"))
    for align in ("stamps", "correlate"):
        with pytest.raises(InputError, match="--offset"):
            compare([runs / "side", runs / "front"], align=align, offset=100.0)
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match="did not make"):
        compare([runs / "side", runs / "front"], output=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_run_without_angles_has_words(runs, tmp_path):
    import pyarrow.parquet as pq

    for name in ("poses.npz", "summary.json"):
        shutil.copy(runs / "side" / name, tmp_path)
    table = pq.read_table(runs / "side/kinematics.parquet")
    of_angles = [name for name in table.column_names if "_deg" in name]
    pq.write_table(table.drop_columns(of_angles), tmp_path / "kinematics.parquet")
    with pytest.raises(InputError, match="r_knee_flexion"):
        load_side(tmp_path)


def test_a_summary_that_is_nested_too_deeply_is_of_no_finished_run(runs, tmp_path):
    shutil.copy(runs / "side" / "poses.npz", tmp_path)
    (tmp_path / "summary.json").write_text("[" * 100_000)
    with pytest.raises(InputError, match="finished"):
        load_side(tmp_path)


@pytest.mark.parametrize("first", [True, False])
def test_an_older_run_without_an_angle_is_compared_in_the_others(runs, sides, tmp_path, first):
    import pyarrow.parquet as pq

    older = tmp_path / "older"
    shutil.copytree(runs / "side", older)
    table = pq.read_table(older / "kinematics.parquet")
    lacking = [name for name in table.column_names if name.startswith("pelvis_obliquity")]
    pq.write_table(table.drop_columns(lacking), older / "kinematics.parquet")
    pair = [load_side(older), sides[1]]
    found = compared(pair if first else pair[::-1])
    (said,) = [each for each in found.notices if each.values.get("run") == "older"]
    assert (said.code, said.values["angles"]) == ("run-lacks-angles", "pelvis_obliquity")
    assert set(found.pairs[0].agreement) == set(ANGLES) - {"pelvis_obliquity"}
    folders = [older, runs / "front"]
    compare(folders if first else folders[::-1], output=tmp_path / "out")
    assert said.text in (tmp_path / "out" / "compare.html").read_text()
    assert said.as_dict() in json.loads((tmp_path / "out" / "compare.json").read_text())["notices"]
