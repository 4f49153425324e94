"""The tables: a perfect rectifier has no error, a known error is measured, lying frames stand apart."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.lab.evaluation import rectifiers as module
from pcnet3d.models.lab.evaluation import sets as evaluation_sets
from pcnet3d.models.lab.evaluation.rectifiers import Take, clean_takes, judge, tables
from pcnet3d.models.lab.evaluation.tables import written
from pcnet3d.models.rectifier.geometric import Geometric
from pcnet3d.pipeline.reading.mocap import Clip


class Fixed:
    """Answers what it was told, in order."""

    method = "fixed"

    def __init__(self, R, expected):
        self.R, self.expected, self.at = R, expected, 0

    def rotation(self, joints):
        rows = slice(self.at, self.at + len(joints))
        self.at += len(joints)
        return self.R[rows], self.expected[rows]


@pytest.fixture
def clip(standing):
    rng = np.random.default_rng(0)
    poses = (standing + rng.normal(0, 0.02, (40, 17, 3))).astype(np.float32)
    return Clip("03_01", "03", "asfamc", 30.0, poses)


@pytest.fixture
def take(clip):
    return clean_takes([clip], "wide")[0]


EVERY = np.ones(40, dtype=bool)


def test_the_truth_has_no_error(take):
    row = judge(Fixed(take.R, np.zeros(40)), [take]).row(EVERY)
    for name in ("rotation", "tilt", "mpjpe", "pa_mpjpe", "frobenius"):
        assert row[name].p95 < 1e-3, name
    assert (row["frames"], row["no answer"]) == (40, 0)


def test_a_known_error_is_measured(take):
    """Ten degrees about up: the heading is wrong, the tilt is not."""
    wrong = take.R @ Rotation.from_rotvec([0, 0, np.radians(10)]).as_matrix()
    row = judge(Fixed(wrong, np.full(40, 10.0)), [take]).row(EVERY)
    assert row["rotation"].mean == pytest.approx(10, abs=1e-3)
    assert row["tilt"].mean == pytest.approx(0, abs=1e-3)
    assert row["frobenius"].mean == pytest.approx(
        np.degrees(2 * np.sqrt(2) * np.sin(np.radians(5))), abs=1e-3
    )
    assert row["mpjpe"].mean > 5
    assert row["pa_mpjpe"].mean < 1e-3


def test_what_lies_within_the_lift_is_told_from_the_rotation(take):
    lifted = 0.5 * take.truth
    row = judge(Fixed(take.R, np.zeros(40)), [Take(lifted, take.truth, take.R, take.lying)]).row(EVERY)
    assert row["mpjpe"].p95 < 1e-3  # the scale is brought to the truth's
    noisy = take.truth + np.random.default_rng(0).normal(0, 0.03, take.truth.shape)
    row = judge(Fixed(take.R, np.zeros(40)), [Take(noisy, take.truth, take.R, take.lying)]).row(EVERY)
    assert row["rotation"].p95 < 1e-3
    assert 20 < row["pa_mpjpe"].mean < row["mpjpe"].mean < 70


def test_frames_sorted_by_expected_error(take):
    angle = np.linspace(0, 40, 40)
    wrong = take.R @ Rotation.from_rotvec(np.radians(angle)[:, None] * [[0, 1, 0]]).as_matrix()
    assert judge(Fixed(wrong, angle**2), [take]).row(EVERY)["spearman"] == pytest.approx(1)
    assert judge(Fixed(wrong, -angle), [take]).row(EVERY)["spearman"] == pytest.approx(-1)
    assert np.isnan(judge(Geometric(), [take]).row(EVERY)["spearman"])


def test_frames_without_an_answer_are_counted_and_left_out(take):
    R = take.R.copy()
    R[:5] = np.nan
    row = judge(Fixed(R, np.zeros(40)), [take]).row(EVERY)
    assert row["no answer"] == 5
    assert row["rotation"].mean < 1e-3


def test_takes_depend_on_seed_and_name_only(clip):
    one, other = clean_takes([clip], "paper")[0], clean_takes([clip], "paper")[0]
    np.testing.assert_array_equal(one.joints, other.joints)
    assert not np.allclose(one.R, clean_takes([clip], "paper", seed=1)[0].R)


def test_the_tables_of_several_rectifiers(clip, monkeypatch):
    lying_down = Clip("03_02", "03", "daz", 30.0, clip.joints[:, :, [2, 1, 0]] * np.float32([1, -1, 1]))
    monkeypatch.setattr(evaluation_sets, "read_clips", lambda subjects: (clip, lying_down))
    monkeypatch.setattr(module, "lifted", lambda question, of: clean_takes([clip], "wide", question.seed))
    results = tables(evaluation_sets.Question((Geometric(),), seed=3, people="test"))
    rows = results["rectifiers"]["geometric"]["rows"]
    assert rows["CMU test, clean, paper's views, upright"]["frames"] == 40
    assert rows["HDM05, clean, wide views, lying"]["frames"] == 40
    assert rows["HDM05, lifted, lying"]["frames"] == 0
    assert rows["CMU test, clean, paper's views, upright"]["rotation"].mean < 12
    text = written(results, module.PAGE)
    assert "| geometric | CMU test, lifted, upright | 40 |" in text
