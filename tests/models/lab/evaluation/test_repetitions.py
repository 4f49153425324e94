"""How repetitions are compared with labels."""

from pcnet3d.models.lab.evaluation.repetitions import Judged, judge


def test_labels_are_compared_by_count_and_by_the_most_time_shared():
    judged = Judged()
    judge(judged, [(1.0, 2.0)], [(0.1, 0.5), (1.1, 2.3)])
    judge(judged, [], [])
    row = judged.row()
    assert (row["series"], row["movements"], row["counts"]) == (2, 1, 0.5)
    assert (row["found"], row["begin"], row["end"]) == (1.0, 1.0, 0.0)
