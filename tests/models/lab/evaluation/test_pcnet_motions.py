"""The evaluation's rows by motion: the frames that the classes name, each with its own view and rectifier."""

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.lab.evaluation import rectifiers as module
from pcnet3d.models.lab.evaluation import sets as evaluation_sets
from pcnet3d.models.lab.evaluation.motion_class import CLASSES, motion_classes
from pcnet3d.models.lab.evaluation.tables import written
from pcnet3d.models.rectifier.geometric import Geometric


@pytest.fixture
def clip():
    return walked(seconds=12)


@pytest.fixture
def results(clip, monkeypatch):
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: (clip,))
    monkeypatch.setattr(
        module, "lifted", lambda question, of: module.clean_takes([clip], "wide", question.seed)
    )
    return module.tables(evaluation_sets.Question((Geometric(),), people="test"))


def test_every_class_has_its_frames(results, clip):
    rows = results["rectifiers"]["geometric"]["motions"]
    frames = {name: int(mask.sum()) for name, mask in motion_classes(clip.joints, clip.fps).items()}
    assert frames["walking"] > 30
    assert frames["running"] == 0
    for name in CLASSES:
        for kind in ("lifted", "clean, paper's views"):
            assert rows[f"CMU test, {kind}, {name}"]["frames"] == frames[name]
    assert "| geometric | HDM05, lifted, squatting |" in written(results, module.PAGE)


def test_who_bends_is_where_geometry_alone_fails(results):
    """GEOMETRIC takes the trunk for up: its tilt error is the trunk's lean."""
    rows = results["rectifiers"]["geometric"]["motions"]
    assert rows["CMU test, lifted, bending"]["tilt"].mean > 30
    assert rows["CMU test, lifted, walking"]["tilt"].mean < 8


def test_a_take_with_some_of_its_frames(clip):
    take = module.clean_takes([clip], "paper")[0]
    rows = take.motion["walking"]
    some = take.some(rows)
    assert len(some.R) == rows.sum()
    np.testing.assert_array_equal(some.joints, take.joints[rows])
    assert some.motion["walking"].all()
    assert len(take.some(slice(None, None, 5)).lying) == -(-len(take.R) // 5)


def test_a_lifted_take_has_the_classes_of_its_clip(clip, monkeypatch):
    """They are taken from the camera's truth turned upright; its origin does not matter."""
    from pcnet3d.models.lab.evaluation import testbed

    monkeypatch.setattr(testbed, "read_clips", lambda subjects: (clip,))
    take = module.lifted(question := evaluation_sets.Question(people="test"), question.sets[0])[0]
    expected = motion_classes(clip.joints, clip.fps)
    for name in CLASSES:
        assert (take.motion[name] == expected[name]).mean() > 0.99, name
