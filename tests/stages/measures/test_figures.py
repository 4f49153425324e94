"""Means with their errors, and standard deviations."""

import numpy as np
import pytest

from golden.motions import CAPTURED, motion_with
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.measures.figures import spread, unknown_deg


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
