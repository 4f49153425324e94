"""Measures as files and pages have them: every figure, with its error, its unit and its time."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from golden.motions import motion_with
from pcnet3d.models.gait.gait import Stride
from pcnet3d.pipeline import H36M17, Z_UP, PoseSequence, Take
from pcnet3d.pipeline.core.measures import Measure, Measures, nested, read_measures, withheld
from pcnet3d.stages.export.tables import Row, rows, stride_tables, write_measures, write_strides
from pcnet3d.stages.measures.walking import peaks
from refusals import refused


def test_the_table_holds_every_figure(take, tmp_path):
    write_measures(take, tmp_path / "measures.csv")
    rows = list(csv.DictReader((tmp_path / "measures.csv").read_text().splitlines()))
    assert list(rows[0]) == list(Row._fields)
    found = {(row["measure"], row["item"]): row for row in rows}
    assert len(found) == len(rows)
    measures = nested(take.measures)
    assert float(found["walking.cadence_spm", ""]["value"]) == measures["walking"]["cadence_spm"]
    assert found["walking.cadence_spm", ""]["unit"] == "1/min"
    assert not any("cycles" in row["measure"] for row in rows)
    assert len(rows) < 600
    symmetry = found["symmetry.hip_abduction.symmetry_index_withheld", ""]
    assert (symmetry["value"], symmetry["text"]) == ("", "range-too-small")


def test_every_stride_has_a_row_for_each_per_cent(take, tmp_path):
    write_strides(take, tmp_path / "strides.csv")
    rows = list(csv.DictReader((tmp_path / "strides.csv").read_text().splitlines()))
    assert {"trunk_lean_sagittal_deg", "pelvis_obliquity_sd_deg", "r_knee_flexion_deg"} <= set(rows[0])
    found = nested(take.measures)
    for side in ("right", "left"):
        own = [row for row in rows if row["movement"] == f"walking.{side}"]
        walk = found["walking"][side]
        assert [int(row["percent"]) for row in own] == [*range(101)] * walk["strides"]
        starts = [float(row["time_s"]) for row in own if row["percent"] == "0"]
        assert starts == pytest.approx(walk["stride_start_s"], abs=1e-3)
        # The means of summary.json are the means of these.
        angle = f"{side[0]}_knee_flexion"
        curves = np.array([float(row[f"{angle}_deg"]) for row in own]).reshape(-1, 101)
        assert curves.mean(axis=0) == pytest.approx(found["walking"]["cycles"][angle]["mean_deg"], abs=1e-3)
    assert sum(row["movement"] == "knee_bends" for row in rows) == 101 * found["knee_bends"]["count"]


def test_the_peaks_of_each_stride_are_those_of_its_curve(take):
    walk = nested(take.measures)["walking"]["right"]
    rows = [row for table in stride_tables(take) for row in table.to_pylist()]
    rows = [row for row in rows if row["movement"] == "walking.right"]
    for number in range(walk["strides"]):
        own = [row for row in rows if row["number"] == number]
        knee, hip = (
            np.array([row[f"r_{part}_flexion_deg"] for row in own]) for part in ("knee", "thigh_trunk")
        )
        off = next(row["percent"] for row in own if row["time_s"] > walk["toe_offs_s"][number])
        assert walk["knee_at_contact_deg"][number] == pytest.approx(knee[0], abs=0.6)
        assert walk["knee_swing_peak_deg"][number] == pytest.approx(knee[off:].max(), abs=0.6)
        assert walk["knee_loading_peak_deg"][number] == pytest.approx(knee[: off // 2 + 1].max(), abs=1.0)
        assert walk["thigh_trunk_lowest_deg"][number] == pytest.approx(hip.min(), abs=0.6)
    assert walk["mean_knee_swing_peak_deg"] == pytest.approx(np.mean(walk["knee_swing_peak_deg"]), abs=0.6)


def test_a_stride_without_the_angle_leaves_a_gap_in_the_list():
    times = np.arange(0, 4, 0.05)
    strides = [Stride("r", i, i + 1, i + 0.6, np.nan, np.nan) for i in range(3)]
    knee = 30 + 30 * np.sin(2 * np.pi * times)
    knee[(times > 0.9) & (times < 1.9)] = np.nan
    found = nested(
        peaks(
            motion_with({"r_knee_flexion": knee, "r_knee_flexion_sd_deg": np.full(80, 4.0)}, times), strides
        )
    )
    assert found["knee_at_contact_deg"][1] is None
    assert found["knee_loading_peak_deg"][0] == pytest.approx(60, abs=1)
    assert found["knee_at_contact_error_deg"][0] == 4.0
    assert (
        found["mean_knee_at_contact_error_deg"] >= 4.0
    )  # what all strides have wrong alike does not average out
    assert "thigh_trunk_lowest_deg" not in found


def test_a_row_has_the_error_the_side_the_unit_and_the_times_of_its_figure():
    bends = {
        "start_s": [1.0, 4.0],
        "stop_s": [2.0, 5.5],
        "peak_deg": [90.0, 101.0],
        "peak_error_deg": [3.0, 4.0],
    }
    walking = {
        "walking_speed": 1.2,
        "walking_speed_error": 0.05,
        "step_time_symmetry_index_percent": 3.0,
        "step_time_within_error": True,
        "left": {"mean_step_length": 0.6},
    }
    poses = PoseSequence(np.zeros((1, 17, 3)), H36M17, Z_UP)
    measures = read_measures({"knee_bends": {"count": 2, **bends}, "walking": walking})
    assert nested(measures) == {"knee_bends": {"count": 2, **bends}, "walking": walking}
    found = list(rows(Take("t", poses=poses, measures=measures)))
    assert [row.measure for row in found] == [
        "knee_bends.count", *["knee_bends.start_s"] * 2, *["knee_bends.stop_s"] * 2, *["knee_bends.peak_deg"] * 2,
        "walking.walking_speed", "walking.step_time_symmetry_index_percent", "walking.step_time_within_error",
        "walking.left.mean_step_length",
    ]  # fmt: skip
    assert found[0] == Row("knee_bends.count", None, None, 2.0, None, None, None, None, None)
    assert found[6] == Row("knee_bends.peak_deg", None, 1, 101.0, 4.0, "deg", 4.0, 5.5, None)
    assert found[7] == Row("walking.walking_speed", None, None, 1.2, 0.05, "m/s", None, None, None)
    assert found[8].unit == "%"
    assert found[9].text == "True"
    assert found[9].value is None
    assert found[10] == Row("walking.left.mean_step_length", "left", None, 0.6, None, "m", None, None, None)


def test_what_is_written_is_read_back(take):
    """Also a count that may be more, and a figure that is withheld."""
    told = (
        Measure("count", 2.0, at_least=True, group=("jumps",)),
        withheld("error-too-large", "walking_speed"),
    )
    for measures in (take.measures, Measures((*told[:1], replace(told[1], group=("walking",))))):
        assert read_measures(json.loads(json.dumps(nested(measures)))) == measures


@pytest.mark.parametrize(
    "measures",
    [
        {"walking": {"stpes": 3}},
        {"strolling": {"steps": 3}},
        {"walking": {"steps": True}},
        {"walking": {"landings_s": 3}},
        {"walking": {"cycles": {"r_knee_flexion": {"mean_deg": [1.0]}}}},
        {"jumps": {"flight_time_s": ["0.5"]}},
    ],
)
def test_a_summary_that_somebody_has_changed_has_words(measures):
    with refused("file-damaged"):
        read_measures(measures)
