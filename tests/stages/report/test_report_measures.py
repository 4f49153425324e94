"""Measures of whatever names become tables and charts."""

import re
from dataclasses import replace

import numpy as np
import pytest

from golden.measures import rows_of
from pcnet3d.pipeline.core.measures import (
    WITHHELD,
    Measure,
    Moments,
    grouped,
    half_bar,
    within,
)
from pcnet3d.stages.drawing.words import range_words
from pcnet3d.stages.measures.stage import Measures
from pcnet3d.stages.report.angles import ranges
from pcnet3d.stages.report.glossary import explained
from pcnet3d.stages.report.measures import FOR_FILES, happened, measure_tables, named
from pcnet3d.stages.study.compare.changes import Change

CURVE = np.linspace(0, 60, 101).tolist()
MEASURES = {
    "cadence_spm": 104.5,
    "range_of_motion": {
        "r_knee_flexion": {"p05_p95_deg": 58.25, "lowest_deg": -1.0, "frames": 240},
        "l_knee_flexion": {"p05_p95_deg": 61.5, "frames": 231},
    },
    "steps": {
        "cycles": {
            "r_knee_flexion": {"count": 4, "mean_deg": CURVE, "sd_deg": [2.0] * 101},
            "l_knee_flexion": {"count": 3, "mean_deg": [np.nan, *CURVE[1:]], "sd_deg": [2.0] * 101},
        }
    },
    "smoothness": {"counted": "fewer than <4> movements"},
}


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("range_of_motion", "deg", "range of motion (°)"),
        ("p05_p95", "deg", "range between them (°)"),
        ("r_wrist_path", "length", "right wrist path (m)"),
        ("peak", "degps", "peak (°/s)"),
        ("count", "", "count"),
        ("thigh_trunk_lowest", "deg", "thigh furthest back (°)"),
        ("mean_thigh_trunk_lowest", "deg", "mean thigh furthest back (°)"),
        ("usual_error", "deg", "usual ± (°)"),
    ],
)
def test_a_figure_is_named_with_its_unit(name, unit, words):
    assert named(Measure(name, 1.0, unit)) == words


def tables(figures, *args, **kwargs):
    return measure_tables(grouped(rows_of(figures)), *args, **kwargs)


def figures(said: str) -> dict[str, str]:
    """Values of the figures that stand alone, by name."""
    return dict(re.findall(r"<span>(.*?)</span>(?:<b>|</summary><b>)(.*?)</b>", said))


def cells(said: str) -> list[str]:
    return re.findall(r"<t[hd]\b[^>]*>(.*?)</t[hd]>", said)


def test_every_figure_is_there_once_under_its_name():
    said = tables(MEASURES)
    assert figures(said)["cadence"] == "100 steps/min"  # its error is not known: two digits
    at = cells(said).index("range between them (°)")
    assert cells(said)[at + 3 : at + 11] == [
        "right knee flexion",
        "58",
        "-1",
        "240",
        "left knee flexion",
        "62",
        "–",
        "231",
    ]
    assert "fewer than &lt;4&gt; movements" in said
    assert re.findall(r"<h[34]>(.*?)</h[34]>", said) == ["Range of motion", "Steps", "Cycles", "Smoothness"]


def test_both_sides_of_a_cycle_share_a_chart():
    said = tables(MEASURES)
    assert re.findall(r"<figcaption>(.*?)</figcaption>", said) == ["Knee flexion (°)"]
    assert said.count("<svg") == 1
    assert "right: n = 4; left: n = 3" in said


def test_lists():
    made = {
        "squats": {"start_s": [1.0, 3.5], "knee_deg": [90.0, 85.5]},
        "walk": {"step_times_s": [0.51, 0.5], "all_steps_s": [0.5] * 40},
    }
    said = tables(made)
    assert cells(said)[1:9] == ["start (s)", "knee (°)", "1", "1.00", "90", "2", "3.50", "86"]
    assert figures(said)["step times"] == "0.51, 0.5 s"
    assert "40 values, in summary.json" in said


def test_more_repetitions_than_a_table_holds_are_counted():
    """An arm raised 21 times, each peak with its error, ended a run in a traceback."""
    for count, peaks in ((2, "170 ± 8.2, 170 ± 8.2"), (21, "21 values, in summary.json")):
        raises = {"count": count, "peak_deg": [170.0] * count, "peak_error_deg": [5.0] * count}
        said = tables({"arm_raises": {"right": raises, "left": raises}}, level=2)
        assert cells(said).count(peaks) == 2, cells(said)


def test_a_repetition_without_a_figure_keeps_its_place():
    """The third of four raises had no peak, and the page listed four starts and three peaks."""
    raises = {"count": 4, "start_s": [1.0, 2.0, 3.0, 4.0], "peak_deg": [150.0, None, 149.0, None]}
    assert "150, –, 149, –" in cells(tables({"arm_raises": {"right": raises, "left": raises}}, level=2))
    assert cells(tables({"knee_bends": raises}))[3:] == [
        *("1", "1.00", "150", "2", "2.00", "–", "3", "3.00", "149", "4", "4.00", "–")
    ]


def test_figures_stand_with_their_errors_and_are_grey_where_these_cover_them():
    measures = {
        "symmetry": {
            "knee_flexion": {
                "right_deg": 49.0,
                "symmetry_index_percent": -19.0,
                "symmetry_index_error_percent": 25.0,
                "within_error": True,
            },
            "thigh_trunk_flexion": {
                "right_deg": 58.0,
                "symmetry_index_percent": 45.0,
                "symmetry_index_error_percent": 16.0,
                "within_error": False,
            },
            "elbow_flexion": {
                "right_deg": 3.0,
                "symmetry_index_withheld": "sides-unlike",
            },
        },
        "range_of_motion": {
            "r_elbow_flexion": {"p05_deg": -156.0, "p95_deg": 20.0, "beyond_anatomy_frames": 2, "nan_share": 0.5},
            "l_elbow_flexion": {"p05_deg": 15.0, "p95_deg": 20.0, "nan_share": 0.0},
            "r_knee_flexion": {"p05_deg": 1.0, "p95_deg": 50.0},
            "r_thigh_trunk_flexion": {"p05_deg": 1.0, "p95_deg": 59.0},
        },
        "knee_bends": {
            "count": 2, "start_s": [0.96496, 2.0], "peak_deg": [57.0, 52.0], "peak_error_deg": [9.1, 8.5],
        },
        "walking": {"steps": 4, "cadence_spm": 98.0, "cadence_error_spm": 1.2, "frames": 98, "nan_share": 0.0},
    }  # fmt: skip
    beside, said = ranges(grouped(rows_of(measures)), None), happened(rows_of(measures), "m")
    assert "<td class=soft>-19 ±\u00a041\u00a0%</td>" in beside
    assert "<td>45 ±\u00a026\u00a0%</td>" in beside
    assert f"<td class=soft>{WITHHELD['sides-unlike']}</td>" in beside
    assert "<td class=soft>-156\u00a0to\u00a020</td>" in beside
    assert "frames beyond anatomy" in beside  # on demand
    assert cells(said)[1:8] == ["start (s)", "peak (°)", "1", "0.96", "57 ± 15", "2", "2.00"]
    assert figures(said)["cadence"] == "98 ± 2 steps/min"
    assert "From 98 frames." in said
    for hidden in ("cadence error", "share without", "peak error"):
        assert hidden not in said


def test_angles_without_a_range_say_why():
    """Beside peaks of knee flexion the table of ranges had no row of it, and no reason."""
    known = {"p05_deg": 3.0, "p95_deg": 20.0}
    why = {
        name: {"withheld": "few-frames"} for name in ("r_knee_flexion", "l_knee_flexion", "l_hip_abduction")
    }
    of = {**why, "pelvis_obliquity": {"withheld": "detector-unsure"}, "r_hip_abduction": known}
    told = str(ranges(grouped(rows_of({"range_of_motion": of})), None))
    assert f"No range of knee flexion, left hip abduction: {WITHHELD['few-frames']}." in told
    assert f"No range of pelvis obliquity: {WITHHELD['detector-unsure']}." in told
    whole = {"range_of_motion": {"r_hip_abduction": known}}
    assert "No range" not in str(ranges(grouped(rows_of(whole)), None))


def test_what_has_no_error_beside_what_has_one_says_so():
    """Feet of a woman who walks straight turned out by 18 to 77 degrees, and her steps were 0.24 m wide, bare of a mark
    beside knees with an error."""
    knee = {f"{end}_deg": 3.0 for end in ("p05", "p95")} | {f"{end}_error_deg": 9.0 for end in ("p05", "p95")}
    foot = {"p05_deg": 18.0, "p95_deg": 77.0}
    of = {"l_knee_flexion": knee, "l_foot_progression": foot}
    assert "<td class=soft>18\u00a0to\u00a077, error not known</td>" in ranges(
        grouped(rows_of({"range_of_motion": of})), "disagreement"
    )
    alone = {"range_of_motion": {"l_foot_progression": foot}}  # the page says that no error is known
    assert "not known)" not in ranges(grouped(rows_of(alone)), "none")
    shown = figures(tables({"walking_speed": 1.1, "mean_step_width": 0.24, "steps": 3}))
    assert (shown["speed"], shown["mean step width"], shown["steps"]) == (
        "1.1 m/s, error not known", "0.24 m, error not known", "3",
    )  # fmt: skip


def test_no_measures():
    assert happened((), "m") == ranges({}, None) == measure_tables({}) == ""


@pytest.mark.parametrize(("length", "per_second"), [("m", "m/s"), ("units", "units/s")])
def test_lengths_and_speeds_have_the_unit_of_the_take(length, per_second):
    paths = {"root": {"path_length": 4.5, "mean_speed": 1.25}}
    walk = {"walking_speed": 1.25, "walking_speed_error": 0.02, "steps": 8}
    said = tables({"paths": paths}, length) + tables(walk, length)
    assert f"path length ({length})" in said
    assert f"mean speed ({per_second})" in said
    assert f"1.25 ± 0.033 {per_second}" in said


def test_only_what_happened_is_shown_and_nothing_is_denied():
    walked = {
        "knee_bends": {"observable_percent": 80.0},
        "jumps": {"observable_percent": 0.0},
        "arm_raises": {"right": {"observable_percent": 60.0}, "left": {"count": 1, "mean_rise_deg": 90.0}},
        "walking": {"gait": "running", "steps": 4, "steps_at_least": True, "mean_step_time_s": 0.6},
    }
    said = happened(rows_of(walked), "m")
    assert re.findall(r"<h3>(.*?)</h3>", said) == ["Running", "Arm raises"]
    assert figures(said)["steps"] == "at least 4"
    assert happened(rows_of({"knee_bends": walked["knee_bends"]}), "m") == ""
    assert "<h3>Squats</h3>" in happened(rows_of({"knee_bends": {"count": 2, "squats": 2}}), "m")
    assert "<h3>Knee bends</h3>" in happened(rows_of({"knee_bends": {"count": 2, "squats": 1}}), "m")


def test_how_much_of_the_take_could_be_judged_is_told_beside_what_was_found():
    for percent, told in ((83.4, True), (100.0, False)):
        said = happened(rows_of({"knee_bends": {"count": 2, "observable_percent": percent}}), "m")
        assert (f"{percent:.0f} % of the take" in said) == told


def test_a_gait_has_its_curves_over_the_gait_cycle_with_toe_offs(monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "pcnet3d.stages.report.measures.over_time",
        lambda curves, x, alt, name: drawn.append((curves, x, name)) or "<svg/>",
    )
    walking = {
        "gait": "running",
        "steps": 8,
        "walking_speed": 3.1,
        "walking_speed_error": 0.065,
        "right": {"mean_stance_percent": 35.0},
        "left": {"steps": 4},
        "cycles": {f"{side}_knee_flexion": {"count": 4, "mean_deg": CURVE} for side in "rl"},
    }
    said = happened(rows_of({"walking": walking, "jumps": {"count": 0}}), "m")
    assert figures(said)["speed"] == "3.10 ± 0.11 m/s"
    ((curves, share, name),) = drawn
    assert name == "gait cycle (%)"
    assert (share[0], share[-1]) == (0, 100)
    assert [(curve.name, curve.mark) for curve in curves] == [("right", 35.0), ("left", None)]


def test_few_members_with_many_figures_are_columns():
    sides = {side: {"steps": n, "strides": 1, "mean_step_time_s": 0.5, "landings_s": [0.5, 1.0]} for n, side in
             enumerate(("right", "left"))}  # fmt: skip
    said = tables(sides, level=3)
    assert cells(said)[:6] == ["", "right", "left", "steps", "0", "1"]
    assert cells(said)[-3:] == ["initial contacts (s)", "0.50, 1.00", "0.50, 1.00"]


def test_the_mean_of_one_stride_does_not_stand_beside_it():
    def page(strides):
        sides = [
            within(side, [*(Measure("swing_peak", 60.0 + i, "deg", number=i) for i in range(strides)),
                          Measure("mean_swing_peak", 60.0, "deg")])
            for side in ("right", "left")
        ]  # fmt: skip
        return measure_tables(grouped([one for side in sides for one in side]), level=3)

    assert "mean swing peak" not in page(1)
    assert "mean swing peak" in page(2)


def test_a_difference_within_its_error_is_said_where_it_stands_alone():
    index = {"step_time_symmetry_index_percent": 6.0, "step_time_symmetry_index_error_percent": 3.7}
    for inside, said in ((True, "6 ± 6.1 %, within its error"), (False, "6 ± 6.1 %")):
        shown = tables({**index, "step_time_within_error": inside})
        assert figures(shown)["step time symmetry index"] == said
        assert ('class="soft"' in shown) == inside


def test_plus_minus_is_the_90_bar_wherever_people_read():
    """It was one standard deviation in some places and nine in ten in others: 10 is 16 everywhere."""
    row = Measure("cadence", 100.0, "spm", 10.0)
    ends = [replace(row, name=name, unit="deg") for name in ("p05", "p95")]
    change = Change("walking", "cadence", "", "", (100.0, 120.0), (10.0, 10.0), 10.0)
    assert figures(measure_tables({"cadence": row}))["cadence"] == "100 ± 16 steps/min"
    assert range_words({end.name: end for end in ends}) == "100\u00a0to\u00a0100 ±\u00a016"
    assert change.difference.endswith("± 16")
    assert change.mdc90 == pytest.approx(row.bar, abs=0.5)
    assert row.bar == half_bar(10.0) == 16.0


def test_every_figure_of_a_walk_is_explained():
    from pcnet3d.examples.walker.walk import walker
    from pcnet3d.pipeline import Pipeline, Take
    from pcnet3d.stages.angles import Angles
    from pcnet3d.stages.measures.stage import Measures
    from pcnet3d.stages.rectify import Rectify
    from pcnet3d.stages.trajectories import Trajectories

    stages = (Rectify(rectifier="geometric"), Trajectories(), Angles(), Measures())
    measures = grouped(Pipeline(stages)(Take("walker", poses=walker().poses)).measures)
    assert measures["walking"]["steps"].value
    assert measures["knee_bends"]["count"].value
    walk, arms = measures["walking"], measures["arm_raises"]
    for group in (walk, walk["right"], measures["knee_bends"], arms["right"]):
        for name, row in group.items():
            if isinstance(row, Measure | Moments | list) and name not in FOR_FILES:
                assert explained(name) or name in ("frames", "nan_share", "observable", "start", "stop"), name


def test_a_speed_without_metres_stands_beside_none_in_metres():
    assert "m/s" in explained("walking_speed")
    assert "m/s" not in explained("walking_speed", metric=False)
    assert "100 to 120" in explained("cadence", metric=False)


def test_a_jump_has_no_height_in_units_beside_the_one_in_centimetres():
    jumps = {"count": 1, "start_s": [1.5], "height_by_flight_time_cm": [12.0], "jump_height": [0.11]}
    shown = {length: measure_tables(grouped(rows_of(jumps)), length) for length in ("m", "units")}
    assert "jump height (cm)" in shown["m"]
    assert ">11<" in shown["m"]
    assert "jump height" not in shown["units"]


def test_no_heading_stands_above_nothing(walk_take):
    """Every page had the heading "Sitting" with nothing below it."""
    said = happened(Measures()(walk_take).measures, "m")
    assert "<h3>" in said
    for title, below in re.findall(r"<h3>(.*?)</h3>(.*?)(?=<h3>|$)", said, flags=re.S):
        assert below.strip(), title


def test_a_reason_that_both_sides_share_is_told_once():
    side = {
        "count": 3,
        "counted": "not measured",
        "reach_percent": 77.0,
        "duration_s": 0.29441,
        "lean_deg": -0.01,
    }
    said = tables({"right": side, "left": side}, level=3)
    assert said.count("not measured") == 1
    assert "0.29" in cells(said)
    assert "0.2944" not in cells(said)
    assert "0" in cells(said)
