"""Ranges of frames in which the detector is sure, right compared with left where both were seen, and the errors that
extension, peaks, ranges and means carry of what they are made of."""

from dataclasses import replace

import numpy as np
import pytest

from golden.motions import CAPTURED, motion_with
from golden.walks import GEOMETRIC, JUDGED, measured, seen_from, unsure
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.repeatability import range_sd
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.signals.angles import ANGLES
from pcnet3d.stages.measures.figures import spread, unknown_deg
from pcnet3d.stages.measures.ranges import ranges, sides_withheld, symmetry_rows
from pcnet3d.stages.measures.stage import Measures

TIME = np.arange(90) / 30


def swinging(seen=slice(None), deeper: float = 0.0, **how):
    """A motion whose angles go from 0 to 50 degrees in each second, the right ones only in some frames; in the first
    half second to `deeper` more."""
    swing = 25 - 25 * np.cos(2 * np.pi * TIME) + np.where(TIME < 0.5, deeper * np.sin(2 * np.pi * TIME), 0)
    right = np.full(len(TIME), np.nan)
    right[seen] = swing[seen]
    return motion_with({name: right if name.startswith("r_") else swing for name in ANGLES}, TIME, **how)


@pytest.mark.parametrize(
    ("deeper", "seen", "why"),
    [
        (0.0, slice(None), None),
        (80.0, slice(None), None),
        (0.0, slice(15, None), None),  # what was not seen is like the rest
        (80.0, slice(15, None), "sides-unlike"),
        (0.0, slice(60, None), "sides-unlike"),
    ],
)
def test_sides_are_compared_where_both_were_seen(deeper, seen, why):
    """Of somebody who crouched and walked off the right knee was seen in the walk alone: "knee flexion -64 ± 17 %"."""
    motion = swinging(seen, deeper)
    knee = nested(symmetry_rows(motion, ranges(motion), {}))["knee_flexion"]
    assert knee.get("symmetry_index_withheld") == why
    assert ("symmetry_index_percent" in knee) == (why is None)


def test_a_range_whose_extremes_are_not_seen_is_withheld():
    """Of a runner the knee was known in stance alone, "17 to 60", true 95; gaps anywhere take nothing from a range."""
    time_s = np.arange(180) / 30
    knee = 50 - 45 * np.cos(2 * np.pi * time_s)
    swing, anywhere = knee > 80, np.isin(np.arange(180) % 45, range(12))
    for hidden, why in ((swing, "frames-missing"), (anywhere, ""), (knee < 15, "frames-missing")):
        motion = motion_with({name: np.where(hidden, np.nan, knee) for name in ANGLES}, time_s)
        assert 0.05 < hidden.mean() < 0.4
        assert ranges(motion)["r_knee_flexion"].why == why


@pytest.mark.parametrize(
    ("joint", "parts"),
    [
        ("l_ankle", ["leg"]),
        ("r_knee", ["leg"]),
        ("r_elbow", ["upper arm", "forearm"]),
        ("l_wrist", ["forearm"]),
    ],
)
def test_a_limb_that_the_detector_is_unsure_of_is_not_compared(filmed, joint, parts):
    """A cyclist in profile, who pedals evenly: "Right and left differ in range of thigh forward -75 ± 35 %"."""
    assert list(sides_withheld(unsure(filmed, joint, slice(36)))) == parts
    for other in (
        unsure(filmed, joint, slice(9)),
        unsure(filmed, joint, slice(36), detector="yolo@0"),
        filmed,
    ):
        assert sides_withheld(other) == {}


def test_sides_that_are_doubtful_are_not_compared(filmed):
    """A report named differences of right and left, and said that these are doubtful in the whole take."""
    doubtful = filmed.saying(notice("left-and-right", evidence="bones"))
    assert sides_withheld(doubtful) == dict.fromkeys(["leg", "upper arm", "forearm"], "sides-doubtful")


@pytest.mark.parametrize(
    ("part", "kept", "lost"),
    [("leg", "elbow_flexion", "knee_flexion"), ("forearm", "thigh_sagittal", "elbow_flexion")],
)
def test_only_what_rests_on_a_doubtful_part_is_withheld(part, kept, lost):
    motion = swinging()
    found = nested(symmetry_rows(motion, ranges(motion), {part: "detector-unsure"}))
    assert "symmetry_index_percent" in found[kept]
    assert found[lost]["symmetry_index_withheld"] == "detector-unsure"


@pytest.mark.parametrize(
    ("unsure", "deeper", "told"),
    [
        (slice(0, 0), 0.0, True),
        (slice(0, 12), 0.0, True),  # the other frames show the same
        (slice(0, 12), 60.0, False),  # a knee behind a car: "22 to 95" of one that bends to 30
        (slice(0, 50), 0.0, False),  # a banner over the legs
    ],
)
def test_a_range_is_of_frames_in_which_the_detector_is_sure(unsure, deeper, told):
    guessed = np.isin(np.arange(len(TIME)), np.arange(len(TIME))[unsure])
    motion = swinging(deeper=deeper, made_by=MadeBy("estimated", "another"))
    motion = replace(motion, unsure={"r_ankle": guessed, "l_knee": ~guessed})
    found = ranges(motion)["r_knee_flexion"]
    assert found.why == ("" if told else "detector-unsure")
    assert np.isfinite(found.values).sum() == (~guessed).sum()


def knee(made_by: MadeBy):
    """The walker's right knee, whose error is 3 degrees where it is bent by less than 20 and 9 above."""
    take = measured(seen_from(walker(), 90.0).with_(made_by=made_by), GEOMETRIC[:3])
    angle = take.kinematics["r_knee_flexion_deg"]
    columns = {**take.kinematics, "r_knee_flexion_sd_deg": np.where(angle < 20, 3.0, 9.0)}
    measures = Measures(repeat=("r_knee_flexion",))(take.with_(kinematics=columns)).figures
    return [measures.group(name, "r_knee_flexion") for name in ("range_of_motion", "repetitions")]


def test_each_end_has_its_own_error_and_the_range_that_of_a_difference():
    ends, repeated = knee(JUDGED)
    assert [ends.figure(name).error for name in ("lowest", "p05", "p95", "highest")] == [3.0, 3.0, 9.0, 9.0]
    assert {peak.error for peak in repeated.repetitions("peak")} == {9.0}
    independent = np.hypot(3, 9)
    span = ends.value("p95") - ends.value("p05")
    lasts_s = float(np.ptp(walker().poses.times))
    assert ends.figure("p05_p95").error == pytest.approx(range_sd("knee_flexion", span, independent, lasts_s))


def test_of_another_lifter_they_are_independent():
    ends, _ = knee(MadeBy("estimated", "somebody@1"))
    assert ends.figure("p05_p95").error == pytest.approx(np.hypot(3, 9))


def test_a_standard_deviation_takes_six_values():
    five = nested(spread("rise", np.arange(5.0)))
    assert "sd_rise_deg" not in five
    six = nested(spread("rise", np.arange(6.0)))
    assert six["sd_rise_deg"] == pytest.approx(1.87, abs=0.01)


def test_one_or_two_durations_are_known_no_better_than_frames_allow():
    """Of one knee bend at 5 frames a second the duration was stated to be known to 0.01 s, of three to 0.06."""
    for values in ([1.0], [1.0, 1.2], [1.0, 1.1, 1.2]):
        said = nested(spread("duration", np.array(values), 0.08, shared=0.01))
        assert said["mean_duration_error_s"] >= 0.08 / np.sqrt(len(values))
    assert "mean_duration_error_s" not in nested(spread("duration", np.array([1.0, 1.2]), 0.08))
    assert nested(spread("rise", np.full(6, 40.0), shared=np.nan)) == {"mean_rise_deg": 40.0}


def test_the_spread_of_repetitions_is_no_error_where_what_they_share_is_unknown():
    """Of a lifter's poses; motion capture has all of them right."""
    values, error = np.array([30.0, 38.0, 46.0]), "mean_rise_error_deg"
    lifted, captured = (
        motion_with({}, np.arange(3.0), made_by=made_by)
        for made_by in (MadeBy("estimated", "another"), CAPTURED)
    )
    assert error not in nested(spread("rise", values, shared=unknown_deg(lifted)))
    found = nested(spread("rise", values, shared=unknown_deg(captured)))
    assert found[error] == pytest.approx(4.6, abs=0.1)
