"""The table of verdicts: takes that are made worse err by more, and are said to."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.lab.evaluation.sets import EvaluationSet, Question
from pcnet3d.models.lab.evaluation.testbed import LiftedTake, see
from pcnet3d.models.lab.evaluation.verdicts import error_mm, tables, worse
from pcnet3d.pipeline import CAMERA
from pcnet3d.pipeline.reading.mocap.clip import Clip


def taken():
    walk = walker(seconds=4.0)
    seen = see(Clip("09_01", "09", "asfamc", 30.0, walk.world.astype(np.float32)), 0)
    poses = seen.keypoints.with_(
        joints=0.7 * seen.truth, frame=CAMERA.with_(unit="arbitrary"), confidence=None
    )
    return LiftedTake(poses, seen)


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
