"""Figures of real keypoints, checked on made ones."""

import numpy as np
import pytest

from pcnet3d.models.evaluation.noise_report import disagreement, report, statistics


@pytest.fixture
def still():
    """(2000, 17, 2): a person of 500 pixels who does not move."""
    rng = np.random.default_rng(0)
    pose = rng.uniform(100, 500, (17, 2))
    pose[0], pose[1] = [300, 0], [300, 500]
    return np.repeat(pose[None], 2000, axis=0)


def test_jitter_of_white_noise_is_its_second_difference(still):
    noisy = still + np.random.default_rng(1).normal(0, 2.0, still.shape)
    figures = statistics(noisy, np.full(still.shape[:2], 0.6))
    np.testing.assert_allclose(figures.jitter, 100 * np.sqrt(6) * 2 / 500, rtol=0.06)
    np.testing.assert_allclose(figures.confidence, 0.6)


def test_steady_motion_is_no_jitter(still):
    moving = still + np.arange(2000)[:, None, None] * np.array([0.5, -0.25])
    np.testing.assert_allclose(statistics(moving, np.full(still.shape[:2], np.nan)).jitter, 0, atol=1e-6)


def test_disagreement_leaves_out_a_constant_difference(still):
    np.testing.assert_allclose(disagreement(still, still + np.array([5.0, -3.0])), 0, atol=1e-9)
    apart = disagreement(still, still + np.random.default_rng(1).normal(0, 5.0, still.shape))
    assert all(0.8 < value < 1.0 for value in apart)  # 1 % of 500 pixels, the worst 5 % left out


@pytest.mark.data
def test_the_noise_lies_between_the_real_detectors(data, monkeypatch):
    monkeypatch.setenv("PCNET3D_DATA", str(data))
    rows = {line.split("|")[1].strip(): line.split("|")[2] for line in report().splitlines()}
    jitter = {name: [float(v) for v in cell.split("/")] for name, cell in rows.items() if "." in cell}
    for ours, steady, shaky in zip(
        jitter["this noise, CMU val"], jitter["skating HRNet"], jitter["demo_man MoveNet"], strict=True
    ):
        assert steady < ours < shaky
