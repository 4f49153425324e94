"""What is said of walks is judged against the steps that are true in the same time."""

import numpy as np
import pytest

from golden.virtual import walked
from golden.walks import GEOMETRIC, measured
from pcnet3d.models.lab.errors.walks import walks
from pcnet3d.models.lab.evaluation.finished import Finished
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.pipeline import CAMERA
from pcnet3d.pipeline.core.measures import Measure, nested
from pcnet3d.pipeline.core.pose import MadeBy


@pytest.fixture(scope="module")
def finished():
    """The walker as captured, finished."""
    seen = see(walked("w", seconds=8, turn_deg=0), 0)
    poses = seen.keypoints.with_(
        joints=seen.truth, frame=CAMERA, confidence=None, made_by=MadeBy("measured", "motion capture")
    )
    return Finished(measured(poses, GEOMETRIC), seen, "w", "here", "walker")


def test_the_walkers_figures_are_inside_their_errors(finished):
    found = {stated.statement: stated for stated in walks(finished)}
    assert {"stance, %", "double support, %", "cadence, steps/min"} <= set(found)
    assert not {"step length, m", "walking speed, m/s"} & set(found)  # of captured poses these have no errors
    for stated in found.values():
        assert stated.person == "w"
        assert np.abs(stated.error) < stated.half


def test_what_is_off_is_judged_by_as_much(finished):
    take = finished.take
    off = tuple(
        Measure(**{**vars(row), "value": row.value + 5.0})
        if getattr(row, "name", "") == "mean_stance"
        else row
        for row in take.measures
    )
    moved = Finished(take.with_(measures=off), finished.truth, "w", "here", "walker")
    was, is_now = (
        next(one.error[0] for one in walks(each) if one.statement == "stance, %")
        for each in (finished, moved)
    )
    assert is_now - was == pytest.approx(5.0)


def test_nothing_is_judged_where_no_walk_was_found(finished):
    assert nested(finished.take.measures)["walking"]["steps"] >= 3
    assert (
        list(walks(Finished(finished.take.with_(measures=()), finished.truth, "w", "here", "walker"))) == []
    )
    assert list(walks(Finished(None, finished.truth, "w", "here", "walker", "refused"))) == []
