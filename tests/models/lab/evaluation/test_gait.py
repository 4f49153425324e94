"""The gait report on a take whose answer is known."""

import pytest

from pcnet3d.models.gait.gait import Stance
from pcnet3d.models.lab.beds import Configuration
from pcnet3d.models.lab.evaluation import gait as module
from pcnet3d.models.lab.evaluation.evaluate import measured
from pcnet3d.models.lab.evaluation.gait import SIDES_APART, matched, true_walks
from pcnet3d.pipeline.core.measures import read_measures


def test_captured_joints_have_the_true_steps_inside_their_errors(captured_walk, monkeypatch, tmp_path):
    monkeypatch.setattr(module, "finished", lambda asked: [captured_walk])
    of = measured("gait", Configuration(), tmp_path)["sets"]["here"]
    walking, figures = of["walking"], of["walking"]["figures"]
    assert (walking["takes"], of["false steps"]) == (1, 0)
    assert walking["steps"]["found"] == walking["steps"]["true"] >= 3
    for name in ("step_time_s", "stance_percent", "cadence", "step_time_s" + SIDES_APART):
        assert figures[name]["inside"] == 1, name
    assert figures["step_time_s"]["error"].p50 < 0.02
    assert walking["events"]["initial contact"]["recall"] > 0.7
    assert walking["events"]["toe-off"]["precision"] == 1


def test_events_are_matched_with_the_nearest_of_the_same_foot_and_once():
    errors, found, true = matched([([1.02, 1.1, 3.0], [1.0, 2.0]), ([], [5.0])])
    assert errors == pytest.approx([0.02])
    assert (found, true) == (3, 3)


def test_steps_that_were_not_counted_are_no_part_of_what_is_judged():
    """Of takes in which the true steps were others than the found ones, 6 of 26 cadences were outside, of the rest none
    of 51: a hop between two walks, and the last landing, after which the take does not show that the foot rests."""
    true = {"r": [0.0, 1.0, 2.0, 4.0, 5.0], "l": [0.5, 1.5, 3.5, 4.5]}
    found = {
        "right": {
            "landings_s": [0.03, 1.02, 4.02, 5.01],
            "stride_start_s": [0.03, 4.02],
            "stride_stop_s": [1.02, 5.01],
        },
        "left": {
            "landings_s": [0.48, 1.47, 3.52, 4.49, 5.5],
            "stride_start_s": [0.48, 3.52, 4.49],
            "stride_stop_s": [1.47, 4.49, 5.5],
        },
    }
    feet = {side: [Stance(side, at_s, at_s + 0.3) for at_s in of] for side, of in true.items()}
    steps = [
        (step.start_s, step.stop_s)
        for walk in true_walks(read_measures({"walking": found}).group("walking"), feet)
        for step in walk
    ]
    assert steps == [(0.0, 0.5), (0.5, 1.0), (1.0, 1.5), (3.5, 4.0), (4.0, 4.5), (4.5, 5.0)]
