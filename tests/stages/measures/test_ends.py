"""Extension, peaks and ranges carry the errors that their ends of the range have."""

import numpy as np
import pytest

from golden.walks import GEOMETRIC, measured
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.models.angle_error.repeatability import range_sd
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.measures.stage import Measures


def knee(lifter: str):
    """The walker's right knee, whose error is 3 degrees where it is bent by less than 20 and 9 above."""
    take = measured(walker().poses.with_(made_by=MadeBy("estimated", lifter)), GEOMETRIC[:3])
    angle = take.kinematics["r_knee_flexion_deg"]
    columns = {**take.kinematics, "r_knee_flexion_sd_deg": np.where(angle < 20, 3.0, 9.0)}
    measures = Measures(repeat=("r_knee_flexion",))(take.with_(kinematics=columns)).figures
    return [measures.group(name, "r_knee_flexion") for name in ("range_of_motion", "repetitions")]


def test_each_end_has_its_own_error_and_the_range_that_of_a_difference():
    ends, repeated = knee(shipped_noise().lifter)
    assert [ends.figure(name).error for name in ("lowest", "p05", "p95", "highest")] == [3.0, 3.0, 9.0, 9.0]
    assert {peak.error for peak in repeated.repetitions("peak")} == {9.0}
    independent = np.hypot(3, 9)
    span = ends.value("p95") - ends.value("p05")
    lasts_s = float(np.ptp(walker().poses.times))
    assert ends.figure("p05_p95").error == pytest.approx(range_sd("knee_flexion", span, independent, lasts_s))
    assert repeated.value("peak_mdc90") < 1.645 * np.hypot(9, 9)


def test_of_another_lifter_they_are_independent():
    ends, repeated = knee("somebody@1")
    assert ends.figure("p05_p95").error == pytest.approx(np.hypot(3, 9))
    assert repeated.value("peak_mdc90") == pytest.approx(1.645 * np.hypot(9, 9))
