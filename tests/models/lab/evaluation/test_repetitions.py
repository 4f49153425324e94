"""How repetitions are compared with labels, and counted in motion capture that is labelled."""

import json
from collections import Counter

import pytest

from pcnet3d.models.lab.beds import Configuration, EvaluationSet, finished
from pcnet3d.models.lab.evaluation.repetitions import LABELS, judge

TAKES = ("14_04", "14_05", "118_03", "118_06", "118_10", "118_30")  # raises of an arm, knee bends


def test_labels_are_compared_by_count_and_by_the_most_time_shared():
    counts = judge([(1.0, 2.0)], [(0.1, 0.5), (1.1, 2.3)])
    assert counts == {"series": 1, "right": 0, "movements": 1, "found": 1, "begin": 1, "end": 0}
    assert judge([], []) == {"series": 1, "right": 1, "movements": 0, "found": 0, "begin": 0, "end": 0}


@pytest.mark.data
def test_labelled_movements_of_real_people_are_counted():
    labels = json.loads(LABELS.read_text(encoding="utf-8"))
    sets = [EvaluationSet("train", "train")]
    captured = Configuration(lifter="", up_told=True)
    takes = list(finished(captured, sets, lambda clip: clip.name in TAKES))
    assert {one.truth.clip for one in takes} == set(TAKES)
    counts = Counter[str]()
    for one in takes:
        for movement, labelled in labels[one.truth.clip].items():
            counts.update(judge(labelled, one.take.figures.group(*movement.split(".")).spans))
    assert counts["right"] == counts["series"]
    assert counts["found"] == counts["movements"]
    assert min(counts["begin"], counts["end"]) >= 0.6 * counts["movements"]
