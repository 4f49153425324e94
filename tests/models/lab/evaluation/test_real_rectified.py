"""Consistency of rectifiers on real lifters' output."""

from __future__ import annotations

import numpy as np
import pytest

from pcnet3d.models import load_rectifier
from pcnet3d.models.lab.evaluation import runs as sets
from pcnet3d.models.lab.evaluation.real_rectified import real_poses, spread_deg, tables


def of(*rectifiers) -> sets.Question:
    return sets.Question(rectifiers, people=None)


def test_the_spread_of_a_cone_is_its_half_angle() -> None:
    azimuth = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    up = np.stack([np.cos(azimuth), np.sin(azimuth), np.full(12, 1 / np.tan(np.radians(5)))], axis=-1)
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    np.testing.assert_allclose(spread_deg(up), 5.0, atol=1e-6)


@pytest.mark.data("lifter")
def test_the_network_brings_two_lifters_of_one_video_nearer_and_the_baseline_does_not(data) -> None:
    results = tables(of(load_rectifier("geometric"), load_rectifier("pcnet")))["real, rectified"]
    apart = {key: figure.mean for key, figure in results["apart"]["boxing: MotionBERT, BlazePose"].items()}
    before, geometric, _, network, network_take = apart.values()
    assert network < before < geometric
    assert network_take < before
    for clip in ("walk_crop", "demo_man"):
        apart = results["apart"][f"{clip}: pcnet3d on MoveNet, BlazePose"]
        camera, *_, network, _ = (figure.p50 for figure in apart.values())
        assert network < camera, clip
    for name, methods in results["up"].items():
        geometric, network = (figure.mean for figure in methods.values())
        if "pcnet3d" not in name:  # our lift is so smooth that the trunk itself is a steady up
            assert network < geometric, name


class _Turned:
    """A rectifier whose BODY is a fixed turn of the camera's axes: bodies are as far apart as before."""

    method = "turned"
    R = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.tile(self.R, (len(joints), 1, 1)), np.full(len(joints), np.nan)


@pytest.mark.data("lifter")
def test_a_fixed_turn_changes_nothing(data) -> None:
    results = tables(of(_Turned()))["real, rectified"]
    for figures in results["apart"].values():
        before, after, _ = figures.values()
        assert after.mean == pytest.approx(before.mean, abs=1e-6)
    assert all(figure.p95 < 1e-5 for row in results["up"].values() for figure in row.values())
    assert len(list(real_poses(of()))) == len(results["up"])
