"""Means with their errors, and standard deviations."""

import numpy as np
import pytest

from pcnet3d.pipeline.core.measures import nested
from pcnet3d.stages.measures.columns import Columns
from pcnet3d.stages.measures.figures import spread


def test_a_standard_deviation_takes_six_values():
    five = nested(spread("rise", "deg", np.arange(5.0)))
    assert "sd_rise_deg" not in five
    assert "6" in five["sd_reason"]
    six = nested(spread("rise", "deg", np.arange(6.0)))
    assert six["sd_rise_deg"] == pytest.approx(1.87, abs=0.01)
    assert "sd_reason" not in six
    assert "sd_reason" not in nested(spread("rise", "deg", np.arange(1.0)))


def test_one_or_two_durations_are_known_no_better_than_frames_allow():
    """Of one knee bend at 5 frames a second the duration was stated to be known to 0.01 s, of three to 0.06."""
    for values in ([1.0], [1.0, 1.2], [1.0, 1.1, 1.2]):
        said = nested(spread("duration", "s", np.array(values), 0.08, shared=0.01))
        assert said["mean_duration_error_s"] >= 0.08 / np.sqrt(len(values))
    assert "mean_duration_error_s" not in nested(spread("duration", "s", np.array([1.0, 1.2]), 0.08))
    assert nested(spread("rise", "deg", np.full(6, 40.0), shared=np.nan)) == {"mean_rise_deg": 40.0}


def test_the_spread_of_repetitions_is_no_error_where_what_they_share_is_unknown():
    """Of a lifter's poses; motion capture has all of them right."""
    values, error = np.array([30.0, 38.0, 46.0]), "mean_rise_error_deg"
    lifted, captured = (Columns({}, np.arange(3.0), (), False, unstated) for unstated in (8.0, 0.0))
    assert error not in nested(spread("rise", "deg", values, shared=lifted.unknown))
    assert nested(spread("rise", "deg", values, shared=captured.unknown))[error] == pytest.approx(
        4.6, abs=0.1
    )
