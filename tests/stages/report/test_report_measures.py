"""Measures become figures, tables, charts and sentences by the catalogue."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.pipeline.core.figures import WITHHELD
from pcnet3d.pipeline.core.measures import Measure, Measures, half_bar, read_measures
from pcnet3d.pipeline.signals.angles import ALL_OF_BOTH, MIDLINE
from pcnet3d.stages.measures.stage import Measures as Stage
from pcnet3d.stages.report.angles import range_words, ranges, sides_compared
from pcnet3d.stages.report.measures import happened
from pcnet3d.stages.study.compare.comparison import Change

CURVE = np.linspace(0, 60, 101).tolist()


def page(figures, metric=True) -> str:
    return happened(read_measures(figures), metric)


def figures(said: str) -> dict[str, str]:
    """Values of the figures that stand alone, by name."""
    return dict(re.findall(r"<span>(.*?)</span>(?:<b>|</summary><b>)(.*?)</b>", said))


def cells(said: str) -> list[str]:
    return re.findall(r"<t[hd]\b[^>]*>(.*?)</t[hd]>", said)


def test_both_sides_of_a_cycle_share_a_chart():
    cycles = {
        "r_knee_flexion": {"count": 4, "mean_deg": CURVE, "sd_deg": [2.0] * 101},
        "l_knee_flexion": {"count": 3, "mean_deg": [np.nan, *CURVE[1:]], "sd_deg": [2.0] * 101},
    }
    said = page({"knee_bends": {"count": 4, "cycles": cycles}})
    assert re.findall(r"<figcaption>(.*?)</figcaption>", said) == ["Knee flexion (°)"]
    assert said.count("<svg") == 1
    assert "right: n = 4; left: n = 3" in said


def test_more_repetitions_than_a_table_holds_are_counted():
    """An arm raised 21 times, each peak with its error, ended a run in a traceback."""
    for count, rows in ((2, 2), (21, 0)):
        times = {end: [float(i) for i in range(count)] for end in ("start_s", "stop_s")}
        raises = {"count": count, **times, "peak_deg": [170.0] * count, "peak_error_deg": [5.0] * count}
        said = page({"arm_raises": {"right": raises, "left": raises}})
        assert cells(said).count("170 ± 8") == 2 * rows
        assert cells(said)[:6] == ["", "right", "left", "count", str(count), str(count)]


def test_a_repetition_without_a_figure_keeps_its_place():
    """The third of four raises had no peak, and the page listed four starts and three peaks."""
    bends = {"count": 4, "start_s": [1.0, 2.0, 3.0, 4.0], "peak_deg": [150.0, None, 149.0, None]}
    assert cells(page({"knee_bends": bends}))[3:] == [
        *("1", "1.00", "150", "2", "2.00", "–", "3", "3.00", "149", "4", "4.00", "–")
    ]


def test_figures_stand_with_their_errors_and_are_grey_where_these_cover_them():
    measures = {
        "symmetry": {
            "knee_flexion": {
                "symmetry_index_percent": -19.0, "symmetry_index_error_percent": 25.0,
                "within_error": True,
            },
            "thigh_trunk_flexion": {
                "symmetry_index_percent": 45.0, "symmetry_index_error_percent": 16.0,
                "within_error": False,
            },
            "elbow_flexion": {"symmetry_index_withheld": "sides-unlike"},
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
        "walking": {"steps": 4, "cadence_spm": 98.0, "cadence_error_spm": 1.2},
    }  # fmt: skip
    beside, said = ranges(read_measures(measures), None), page(measures)
    assert "<td class=soft>-19 ±\u00a041\u00a0%</td>" in beside
    assert "<td>45 ±\u00a026\u00a0%</td>" in beside
    assert f"<td class=soft>{WITHHELD['sides-unlike']}</td>" in beside
    assert "<td class=soft>-156\u00a0to\u00a020</td>" in beside
    assert cells(said)[1:8] == ["start (s)", "peak (°)", "1", "0.96", "57 ± 15", "2", "2.00"]
    assert figures(said)["cadence"] == "98 ± 2 steps/min"


def test_angles_without_a_range_say_why():
    """Beside peaks of knee flexion the table of ranges had no row of it, and no reason."""
    known = {"p05_deg": 3.0, "p95_deg": 20.0}
    why = {
        name: {"withheld": "few-frames"} for name in ("r_knee_flexion", "l_knee_flexion", "l_hip_abduction")
    }
    of = {**why, "pelvis_obliquity": {"withheld": "detector-unsure"}, "r_hip_abduction": known}
    told = str(ranges(read_measures({"range_of_motion": of}), None))
    assert f"No range of knee flexion, left hip abduction: {WITHHELD['few-frames']}." in told
    assert f"No range of pelvic obliquity: {WITHHELD['detector-unsure']}." in told
    assert "No range" not in str(ranges(read_measures({"range_of_motion": {"r_hip_abduction": known}}), None))


def test_what_has_no_error_beside_what_has_one_says_so():
    """Feet of a woman who walks straight turned out by 18 to 77 degrees, and her steps were 0.24 m wide, bare of a mark
    beside knees with an error."""
    knee = {f"{end}_deg": 3.0 for end in ("p05", "p95")} | {f"{end}_error_deg": 9.0 for end in ("p05", "p95")}
    foot = {"p05_deg": 18.0, "p95_deg": 77.0}
    of = {"l_knee_flexion": knee, "l_foot_progression": foot}
    assert "<td class=soft>18\u00a0to\u00a077, error not known</td>" in ranges(
        read_measures({"range_of_motion": of}), "disagreement"
    )
    alone = {"range_of_motion": {"l_foot_progression": foot}}  # the page says that no error is known
    assert "not known)" not in ranges(read_measures(alone), "none")
    shown = figures(page({"walking": {"walking_speed": 1.1, "mean_step_width": 0.24, "steps": 3}}))
    assert (shown["speed"], shown["mean step width"], shown["steps"]) == (
        "1.1 m/s, error not known", "0.24 m, error not known", "3",
    )  # fmt: skip


def test_only_what_happened_is_shown_and_nothing_is_denied():
    walked = {
        "knee_bends": {"observable_percent": 80.0},
        "jumps": {"observable_percent": 0.0},
        "arm_raises": {"right": {"observable_percent": 60.0}, "left": {"count": 1, "mean_rise_deg": 90.0}},
        "walking": {"gait": "running", "steps": 4, "steps_at_least": True, "mean_step_time_s": 0.6},
    }
    said = page(walked)
    assert re.findall(r"<h3>(.*?)</h3>", said) == ["Running", "Arm raises"]
    assert figures(said)["steps"] == "at least 4"
    assert page({"knee_bends": walked["knee_bends"]}) == ""
    assert "<h3>Squats</h3>" in page({"knee_bends": {"count": 2, "squats": 2}})
    assert "<h3>Knee bends</h3>" in page({"knee_bends": {"count": 2, "squats": 1}})


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
    assert figures(page({"walking": walking}))["speed"] == "3.10 ± 0.11 m/s"
    ((curves, share, name),) = drawn
    assert name == "gait cycle (%)"
    assert (share[0], share[-1]) == (0, 100)
    assert [(curve.name, curve.mark) for curve in curves] == [("right", 35.0), ("left", None)]


def test_a_difference_within_its_error_is_said_where_it_stands_alone():
    index = {"step_time_symmetry_index_percent": 6.0, "step_time_symmetry_index_error_percent": 3.7}
    for inside, said in ((True, "6 ± 6 %, within its error"), (False, "6 ± 6 %")):
        shown = page({"walking": {**index, "step_time_within_error": inside}})
        assert figures(shown)["step time, right minus left"] == said
        assert ('class="soft"' in shown.replace('<p class="soft">', "")) == inside


def test_plus_minus_is_the_90_bar_wherever_people_read():
    """It was one standard deviation in some places and nine in ten in others: 10 is 16 everywhere."""
    row = Measure("cadence", 100.0, 10.0, group=("walking",))
    ends = Measures(tuple(replace(row, name=name, group=()) for name in ("p05", "p95")))
    change = Change("walking", "cadence", "", "", 100.0, 120.0, (10.0, 10.0), 10.0)
    assert figures(happened(Measures((row,)), True))["cadence"] == "100 ± 16 steps/min"
    assert range_words(ends) == "100 ±\u00a016"
    assert change.in_words.endswith("± 16")
    assert change.mdc90 == pytest.approx(row.bar, abs=0.5)
    assert row.bar == half_bar(10.0) == 16.0


def test_without_a_scale_no_length_and_no_speed_is_on_the_page():
    jumps = {"count": 1, "start_s": [1.5], "height_by_flight_time_cm": [12.0], "jump_height": [0.11]}
    shown = {
        metric: page({"jumps": jumps, "walking": {"walking_speed": 1.2, "steps": 3}}, metric)
        for metric in (True, False)
    }
    assert "jump height (m)" in shown[True]
    for words in ("jump height", "speed", "units"):
        assert words not in re.sub(r"<p>.*?</p>", "", shown[False])
    assert "height by flight time (cm)" in shown[False]


def test_no_heading_stands_above_nothing(walk_take):
    """Every page had the heading "Sitting" with nothing below it."""
    said = happened(Stage()(walk_take).figures, True)
    assert "<h3>" in said
    for title, below in re.findall(r"<h3>(.*?)</h3>(.*?)(?=<h3>|$)", said, flags=re.S):
        assert below.strip(), title


def test_it_says_whether_the_sides_differ_by_more_than_their_errors():
    knee = {"symmetry_index_percent": -20.0, "symmetry_index_error_percent": 15.0, "within_error": True}
    hip = {"symmetry_index_percent": 30.0, "symmetry_index_error_percent": 6.0, "within_error": False}

    def compared(figures):
        return sides_compared(read_measures(figures))

    assert compared({}) == []
    assert (
        compared({"symmetry": {"knee_flexion": {"symmetry_index_percent": 50.0}}}) == []
    )  # no error is stated
    steps = {f"step_length_{key}": value for key, value in knee.items()}
    (same,) = compared({"symmetry": {"knee_flexion": knee}, "walking": steps})
    assert same == "No clear difference between right and left."
    # A man on one leg, whose right elbow bent five times as far, had no clear difference: the errors were large.
    assert compared({"symmetry": {"knee_flexion": knee}}) == []
    walking = {f"step_length_{key}": value for key, value in hip.items()}
    (apart,) = compared({"symmetry": {"knee_flexion": knee, "thigh_trunk_flexion": hip}, "walking": walking})
    assert compared({"symmetry": {"knee_flexion": {"symmetry_index_withheld": "sides-unlike"}}}) == []
    assert apart == (
        "Right and left differ in range of hip flexion (thigh against trunk) +30 ± 10 %, step length +30 ± 10 % "
        "(right minus left; 3 figures compared)."
    )


def test_one_difference_among_many_may_be_chance():
    """A man who balances was filmed by four cameras: each page named another difference of his sides, and most were
    none."""
    angles = [name for name in ALL_OF_BOTH if name not in MIDLINE]
    figures = {name: {"symmetry_index_percent": 2.0, "symmetry_index_error_percent": 20.0} for name in angles}
    figures[angles[0]] = {"symmetry_index_percent": 50.0, "symmetry_index_error_percent": 20.0}
    assert sides_compared(read_measures({"symmetry": figures})) == []
    figures[angles[0]] = {"symmetry_index_percent": 150.0, "symmetry_index_error_percent": 20.0}
    (said,) = sides_compared(read_measures({"symmetry": figures}))
    assert "differ in" in said
    assert "+150" in said
    assert said.count("±") == 1
