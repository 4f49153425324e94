"""The table of verdicts: takes that are made worse err by more, and are said to."""

import numpy as np
import pytest

from golden.virtual import exact, walked
from pcnet3d.models.lab.evaluation.sets import EvaluationSet, Question
from pcnet3d.models.lab.evaluation.verdicts import error_mm, tables, worse


def taken():
    return exact(walked(seconds=4.0), confidence=None)


def test_the_scale_is_no_error_and_what_is_worse_is():
    take = taken()
    assert error_mm(take.lifted, take.seen.truth) == pytest.approx(0, abs=1e-3)
    assert error_mm(worse(take.lifted, np.random.default_rng(0)), take.seen.truth) > 30


def test_takes_are_counted_by_verdict(monkeypatch):
    monkeypatch.setattr(Question, "sets", (EvaluationSet("CMU val", "val"),))
    monkeypatch.setattr(Question, "takes", lambda self, of: [taken()] * 2)
    found = tables(Question())["verdicts"]
    assert {lifter: sum(row["takes"] for row in rows.values()) for lifter, rows in found.items()} == {
        "as it is": 2,
        "worse": 2,
    }
    assert all(0 <= row["over"] <= 1 for rows in found.values() for row in rows.values())
