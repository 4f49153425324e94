"""Measures of whatever names become tables and charts."""

import re

import numpy as np
import pytest

from pcnet3d.stages.report.measures import measure_tables, named
from pcnet3d.stages.report.stage import measure_sections

CURVE = np.linspace(0, 60, 101).tolist()
MEASURES = {
    "cadence_spm": 104.5,
    "range_of_motion": {
        "r_knee_flexion": {"p05_p95_deg": 58.25, "lowest_deg": -1.0, "frames": 240},
        "l_knee_flexion": {"p05_p95_deg": 61.5, "lowest_deg": None, "frames": 231},
    },
    "cycles": {
        "steps": {
            "r_knee_flexion": {"count": 4, "mean_deg": CURVE, "sd_deg": [2.0] * 101},
            "l_knee_flexion": {"count": 3, "mean_deg": [None, *CURVE[1:]], "sd_deg": [2.0] * 101},
        },
    },
    "smoothness": {"reason": "fewer than <4> movements"},
}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("range_of_motion_deg", "range of motion (°)"),
        ("p05_p95_deg", "range between them (°)"),
        ("r_wrist_path_m", "right wrist path (m)"),
        ("peak_degps", "peak (°/s)"),
        ("count", "count"),
    ],
)
def test_names_and_units_are_those_of_the_keys(key, words):
    assert named(key) == words


def test_every_figure_is_there_once_under_its_name():
    said = measure_tables(MEASURES)
    cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", said)
    assert "<dt>cadence</dt><dd>104.5 steps/min</dd>" in said
    at = cells.index("range between them (°)")
    assert cells[at + 3 : at + 11] == [
        "right knee flexion",
        "58.2",
        "-1",
        "240",
        "left knee flexion",
        "61.5",
        "–",
        "231",
    ]
    assert "Reason: fewer than &lt;4&gt; movements." in said
    assert re.findall(r"<h3>(.*?)</h3>", said) == ["Range of motion", "Cycles", "Smoothness"]
    assert re.findall(r"<h4>(.*?)</h4>", said) == ["Steps"]


def test_both_sides_of_a_cycle_share_a_chart():
    said = measure_tables(MEASURES)
    assert re.findall(r"<figcaption>(.*?)</figcaption>", said) == ["Knee flexion (°)"]
    assert said.count("<img") == 1
    assert "right: n = 4; left: n = 3" in said


def test_lists():
    made = {
        "squats": [{"start_s": 1.0, "knee_deg": 90.0}, {"start_s": 3.5, "knee_deg": 85.5}],
        "walk": {"step_times_s": [0.51, 0.5], "all_steps_s": [0.5] * 40, "mean_m": [0.0] * 101},
    }
    said = measure_tables(made)
    cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", said)
    assert cells[1:9] == ["start (s)", "knee (°)", "1", "1.00", "90.0", "2", "3.50", "85.5"]
    assert "<dt>step times</dt><dd>0.51, 0.5 s</dd>" in said
    assert "40 values, in summary.json" in said
    assert re.findall(r"<figcaption>(.*?)</figcaption>", said) == ["Walk (m)"]


def test_figures_stand_with_their_errors_and_are_grey_where_these_cover_them():
    measures = {
        "symmetry": {
            "knee_flexion": {
                "right_deg": 49.0,
                "symmetry_index_percent": -19.0,
                "symmetry_index_error_percent": 25.0,
                "within_error": True,
            },
            "hip_flexion": {
                "right_deg": 58.0,
                "symmetry_index_percent": 45.0,
                "symmetry_index_error_percent": 16.0,
                "within_error": False,
            },
        },
        "range_of_motion": {
            "r_elbow_flexion": {"lowest_deg": -156.0, "beyond_anatomy_frames": 2, "nan_share": 0.5},
            "l_elbow_flexion": {"lowest_deg": 15.0, "nan_share": 0.0},
        },
        "knee_bends": {"peak_deg": [57.0, 52.0], "peak_error_deg": [9.1, 8.5], "start_s": [0.96496, 2.0]},
        "walking": {"cadence_spm": 98.0, "cadence_error_spm": 1.2, "frames": 98, "nan_share": 0.0},
    }
    said = measure_tables(measures)
    assert "<td class=soft>-19 ± 25</td>" in said
    assert "<td>45 ± 16</td>" in said
    assert "<td class=soft>-156</td>" in said
    assert "frames beyond anatomy" in said
    assert "50 %" in said
    assert "<dd>57 ± 9.1, 52 ± 8.5°</dd>" in said
    assert "<dd>0.96, 2.00 s</dd>" in said
    assert "<dd>98 ± 1.2 steps/min</dd>" in said
    for hidden in ("within", "symmetry index error", "cadence error", "0.000", "49.0"):
        assert hidden not in said.split("Grey")[1].split("</p>", 1)[1]


@pytest.mark.parametrize("nothing", [None, {}])
def test_no_measures(nothing):
    assert measure_tables(nothing) == ""


@pytest.mark.parametrize(("length", "per_second"), [("m", "m/s"), ("au", "au/s")])
def test_lengths_and_speeds_have_the_unit_of_the_take(length, per_second):
    paths = {"root": {"path_length": 4.5, "mean_speed": 1.25}}
    walk = {"walking_speed": 1.25, "walking_speed_error": 0.02, "steps": 8}
    said = measure_tables({"paths": paths, "walking": walk}, length)
    assert f"path length ({length})" in said
    assert f"mean speed ({per_second})" in said
    assert f"1.25 ± 0.02 {per_second}" in said


def test_a_gait_has_a_section_of_its_own_and_standing_has_none():
    walked = {"walking": {"steps": 4, "mean_step_time_s": 0.6}, "jumps": {"count": 0}}
    assert [title for title, _ in measure_sections(walked, "m")] == ["Gait: walking", "Measures"]
    (gait, rest) = (words for _, words in measure_sections(walked, "m"))
    assert "step time" in gait
    assert "step time" not in rest
    assert [title for title, _ in measure_sections({"walking": {"steps": 0}}, "m")] == ["Measures"]


def test_a_gait_section_has_its_curves_over_the_gait_cycle_with_toe_offs(monkeypatch):
    drawn = []
    monkeypatch.setattr(
        "pcnet3d.stages.report.measures.over_time",
        lambda curves, x, name: drawn.append((curves, x, name)) or b"<svg/>",
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
    ((title, gait), _) = measure_sections({"walking": walking, "jumps": {"count": 0}}, "m")
    assert title == "Gait: running"
    assert "3.10 ± 0.065 m/s" in gait
    ((curves, share, name),) = drawn
    assert name == "gait cycle (%)"
    assert (share[0], share[-1]) == (0, 100)
    assert [(curve.name, curve.mark) for curve in curves] == [("right", 35.0), ("left", None)]


def test_a_difference_within_its_error_is_said_where_it_stands_alone():
    index = {"step_time_symmetry_index_percent": 6.0, "step_time_symmetry_index_error_percent": 3.7}
    for within, said in ((True, "6 ± 3.7 %, within its error"), (False, "6 ± 3.7 %</dd>")):
        assert said in measure_tables({"walking": {**index, "step_time_within_error": within}})
