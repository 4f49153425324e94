"""What a run's rows say is judged against the truth of the same steps, flights and repetitions."""

import numpy as np
import pytest

from golden.virtual import walked
from golden.walks import GEOMETRIC, measured
from pcnet3d.models.lab.evaluation.figures import figures, same_rows
from pcnet3d.models.lab.evaluation.runs import Finished
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.pipeline import CAMERA
from pcnet3d.pipeline.core.measures import Measure, Measures, Moments, nested
from pcnet3d.pipeline.core.pose import MadeBy


@pytest.fixture(scope="module")
def finished():
    """The walker as captured, finished."""
    seen = see(walked("w", seconds=8, turn_deg=0), 0)
    poses = seen.keypoints.with_(
        joints=seen.truth, frame=CAMERA, confidence=None, made_by=MadeBy("measured", "motion capture")
    )
    return Finished(measured(poses, GEOMETRIC), seen, "here")


def test_the_walkers_figures_are_inside_their_errors(finished):
    found = {stated.statement: stated for stated in figures(finished)}
    assert {"stance, %", "double support, %", "cadence, steps/min"} <= set(found)
    assert not {"step length, m", "walking speed, m/s"} & set(found)  # of captured poses these have no errors
    for stated in found.values():
        assert stated.person == "w"
        assert np.abs(stated.error) < stated.half


def test_nothing_is_judged_where_no_walk_was_found(finished):
    assert nested(finished.take.measures)["walking"]["steps"] >= 3
    assert list(figures(Finished(finished.take.with_(measures=Measures()), finished.truth, "here"))) == []
    assert list(figures(Finished(None, finished.truth, "here", "refused"))) == []


def repeated(*peaks, error=2.0, **means):
    """Rows of a movement whose repetitions reach their peak at (seconds, degrees)."""
    rows = [Measure("peak", height, error, number=i) for i, (_, height) in enumerate(peaks)]
    times = {"start": -0.5, "stop": 0.5}
    rows += [Moments(name, tuple(at + off for at, _ in peaks)) for name, off in times.items()]
    return Measures((*rows, *(Measure(name, value, error) for name, value in means.items())))


def test_repetitions_are_compared_with_those_of_the_same_time_and_means_of_as_many():
    true = repeated((1.0, 90.0), (2.0, 80.0), (3.0, 100.0), mean_rise=90.0)

    def off(*peaks, **means):
        pairs = list(same_rows(repeated(*peaks, **means), true))
        return [(figure, row.value - of.value) for figure, row, of in pairs]

    others = off((2.1, 85.0), (3.0, 97.0), (9.0, 50.0), mean_rise=80.0)
    assert others == [("peak, deg", 5.0), ("peak, deg", -3.0)]
    assert ("mean rise, deg", -10.0) in off((1.0, 90.0), (2.0, 80.0), (3.0, 100.0), mean_rise=80.0)
    assert off((2.1, 85.0), mean_rise=80.0) == [("peak, deg", 5.0)]
    assert off() == []
