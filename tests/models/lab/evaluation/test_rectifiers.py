"""The tables: a perfect rectifier has no error, a known error is measured, lying frames stand apart."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.lab import beds as evaluation_sets
from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.evaluation import rectifiers as module
from pcnet3d.models.lab.evaluation.evaluate import measured
from pcnet3d.models.lab.evaluation.rectifiers import clean_takes, judge, summary
from pcnet3d.models.rectifier.load import Geometric


class Fixed(NamedTuple):
    """Answers what it was told."""

    R: np.ndarray
    expected: np.ndarray
    method = "fixed"

    def rotation(self, joints):
        return self.R, self.expected


@pytest.fixture
def take(clips):
    return clean_takes(clips["test"], "wide")[0]


def test_the_truth_has_no_error_and_a_known_error_is_measured(take):
    """Ten degrees about up: the heading is wrong, the tilt is not."""
    figures = summary(judge(Fixed(take.R, np.zeros(60)), [take]))
    for name in ("rotation", "tilt", "mpjpe", "pa_mpjpe", "frobenius"):
        assert figures[name].p95 < 1e-3, name
    assert (figures["frames"], figures["no answer"]) == (60, 0)
    wrong = take.R @ Rotation.from_rotvec([0, 0, np.radians(10)]).as_matrix()
    figures = summary(judge(Fixed(wrong, np.full(60, 10.0)), [take]))
    assert figures["rotation"].mean == pytest.approx(10, abs=1e-3)
    assert figures["tilt"].mean == pytest.approx(0, abs=1e-3)
    chord = np.degrees(2 * np.sqrt(2) * np.sin(np.radians(5)))
    assert figures["frobenius"].mean == pytest.approx(chord, abs=1e-3)
    assert figures["mpjpe"].mean > 5
    assert figures["pa_mpjpe"].mean < 1e-3


def test_what_lies_within_the_lift_is_told_from_the_rotation_and_its_scale_is_the_truths(take):
    noisy = 0.5 * (take.truth + np.random.default_rng(0).normal(0, 0.03, take.truth.shape))
    worse = summary(judge(Fixed(take.R, np.zeros(60)), [replace(take, joints=noisy)]))
    assert worse["rotation"].p95 < 1e-3
    assert 20 < worse["pa_mpjpe"].mean < worse["mpjpe"].mean < 70


def test_the_tables_of_several_rectifiers(clips, monkeypatch, tmp_path):
    (clip,) = clips["test"]
    lying_down = Clip("03_02", "03", "daz", 30.0, clip.joints[:, :, [2, 1, 0]] * np.float32([1, -1, 1]))
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: (clip, lying_down))
    monkeypatch.setattr(module, "lifted_takes", lambda asked, of: clean_takes([clip], "wide", asked.seed))
    asked = evaluation_sets.Configuration(rectifiers=(Geometric(),), seed=3, people="test")
    of = measured("rectifiers", asked, tmp_path)["rectifiers"]["geometric"]["rows"]
    assert of["CMU test, clean, paper's views, upright"]["frames"] == 60
    assert of["HDM05, clean, wide views, lying"]["frames"] == 60
    assert of["HDM05, lifted, lying"]["frames"] == 0
    assert of["CMU test, clean, paper's views, upright"]["rotation"].mean < 12
    assert of["CMU test, lifted, upright"]["frames"] == 60
