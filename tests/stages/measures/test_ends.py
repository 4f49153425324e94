"""Extension, peaks, ranges and means carry the errors of what they are made of."""

import numpy as np
import pytest

from golden.motions import CAPTURED, motion_with
from golden.walks import GEOMETRIC, JUDGED, measured, seen_from
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.repeatability import range_sd
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.measures.figures import spread, unknown_deg
from pcnet3d.stages.measures.stage import Measures


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
    assert repeated.value("peak_mdc90") < 1.645 * np.hypot(9, 9)


def test_of_another_lifter_they_are_independent():
    ends, repeated = knee(MadeBy("estimated", "somebody@1"))
    assert ends.figure("p05_p95").error == pytest.approx(np.hypot(3, 9))
    assert repeated.value("peak_mdc90") == pytest.approx(1.645 * np.hypot(9, 9))


def test_a_standard_deviation_takes_six_values():
    five = nested(spread("rise", np.arange(5.0)))
    assert "sd_rise_deg" not in five
    assert five["sd_withheld"] == "few-values"
    six = nested(spread("rise", np.arange(6.0)))
    assert six["sd_rise_deg"] == pytest.approx(1.87, abs=0.01)
    assert "sd_withheld" not in six
    assert "sd_withheld" not in nested(spread("rise", np.arange(1.0)))


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
