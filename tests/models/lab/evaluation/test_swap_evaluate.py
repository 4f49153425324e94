"""How swaps are judged: the noise's own are known, and hits and misses are counted by hand."""

import json

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.lab.evaluation import evaluate as evaluate_module
from pcnet3d.models.lab.evaluation import sets as evaluation_sets
from pcnet3d.models.lab.evaluation import swaps as swap_evaluate
from pcnet3d.models.lab.evaluation.swaps import Tally, own_swaps
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.models.lab.synthetic.keypoint_noise import Noise
from pcnet3d.pipeline.reading.mocap.clip import Clip
from pcnet3d.pipeline.signals.swaps import Swap, kinds


@pytest.fixture(scope="module")
def clip() -> Clip:
    return walked("09_01")


def test_the_noises_own_swaps_are_known(clip):
    noise = Noise(swap_rate=0.1, profile_cosine=0.0)
    right, swapped = (
        see(clip, 0, noise=n).keypoints for n in (Noise(swap_rate=0.0, profile_cosine=0.0), noise)
    )
    made = own_swaps(right, swapped)
    assert {one.kind for one in made} == {"legs exchanged", "arms exchanged"}
    again, ways = swapped.joints.copy(), {way.name: way for way in kinds(swapped.layout, depth=False)}
    for swap in made:
        rows = slice(swap.first_row, swap.last_row + 1)
        again[rows] = ways[swap.kind].applied(again[rows])
    both = np.isfinite(again) & np.isfinite(right.joints)  # what is missing is missing under its wrong name
    assert both.mean() > 0.9
    np.testing.assert_array_equal(again[both], right.joints[both])


def test_counts_by_hand():
    tally = Tally()
    made = [
        Swap("legs exchanged", 10, 19, 9.0),
        Swap("legs exchanged", 40, 43, 9.0),
        Swap("arms exchanged", 40, 43, 9.0),
    ]
    found = [
        Swap("legs exchanged", 10, 15, 9.0),  # 6 of 10 rows: found
        Swap("legs exchanged", 40, 43, 9.0),  # the arms with them are missed
        Swap("arms exchanged", 70, 71, 9.0),  # nothing there
    ]
    tally.add(made, found)
    figures = tally.figures()
    assert (figures["swaps"], figures["recall"], figures["precision"]) == (3, 2 / 3, 2 / 3)


def test_a_miss_of_rows_or_kind_is_a_miss():
    for other in (Swap("legs exchanged", 10, 12, 9.0), Swap("arms exchanged", 10, 19, 9.0)):
        tally = Tally()
        tally.add([Swap("legs exchanged", 10, 19, 9.0)], [other])
        assert (tally.figures()["recall"], tally.figures()["precision"]) == (0, 0)


def test_the_command_writes_a_report(tmp_path, monkeypatch, clip):
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: (clip,))
    evaluate_module.swaps(output=tmp_path / "out", sets="test", because="known answers")
    results = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    assert set(results["in profile"]) == {"CMU test", "HDM05"}
    assert "| CMU test | " in (tmp_path / "out" / "evaluation.md").read_text()


@pytest.mark.data
def test_few_false_ones_and_few_missed_on_validation_subjects(data):
    """Loose bounds on people that the constants were chosen by: docs/files.md has the figures."""
    clips = read_clips("val", data)[:4]
    figures = swap_evaluate.one_set(evaluation_sets.Question(), "val", clips)
    assert figures["recall"] > 0.8
    assert figures["precision"] > 0.9
    assert figures["on_one_recall"] > 0.8
    assert figures["alarms"] == 0
