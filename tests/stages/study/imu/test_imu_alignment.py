"""Lag, rate and heading between two clocks and two worlds, from accelerations whose answers are known."""

import numpy as np
import pytest

from golden.strapped import Faults, strapped
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.rotations import turned
from pcnet3d.pipeline.signals.imu import GRAVITY_MPS2, point_on
from pcnet3d.stages.study.imu.align import Signal, agreement, align
from pcnet3d.stages.study.imu.motion import (
    as_vertical,
    even_times,
    imu_signal,
    path_acceleration,
    still_pelvis,
)
from refusals import refused

CUTOFF = 6.0


def seen(walk, segment, seams=()):
    """What a perfect video shows: even times and accelerations relative to the pelvis."""
    grid = even_times(walk.time_s, CUTOFF)
    path = point_on(segment, walk.world - walk.world[:, :1])
    return grid, path_acceleration(path, walk.time_s, seams, grid, CUTOFF)


def felt(walk, segment, faults):
    pelvis = imu_signal(strapped(walk, "pelvis", faults, seed=1), None, CUTOFF)
    return imu_signal(strapped(walk, segment, faults), pelvis, CUTOFF)


def test_video_acceleration_is_the_true_one(walk):
    grid, found = seen(walk, "r_forearm")
    truth = point_on("r_forearm", walk.acceleration_mps2 - walk.acceleration_mps2[:, :1])
    found = Signal(grid, found)(walk.time_s)
    error = np.sqrt(np.nanmean((found - truth) ** 2))
    assert error < 0.05 * np.sqrt(np.mean(truth**2))
    assert np.isfinite(found).all(axis=1).mean() > 0.95


@pytest.mark.parametrize("segment", ["r_forearm", "l_shank", "r_thigh"])
@pytest.mark.parametrize(("lag", "heading"), [(0.137, 70.0), (-1.2345, -160.0), (0.0, 0.0)])
def test_lag_and_heading_of_the_walker(walk, segment, lag, heading):
    faults = Faults(lag_s=lag, heading_deg=heading)
    grid, video = seen(walk, segment)
    signal = felt(walk, segment, faults)
    found = align(grid, video, signal, 3.0)
    assert found.lag_s == pytest.approx(lag, abs=0.005)
    assert found.rate == 1
    apart = (found.heading_deg + heading + 180) % 360 - 180  # the video's world less the IMU's
    assert abs(apart) < 2
    assert found.score > 0.99
    for axis, of in agreement(
        video, turned(signal(found.imu_time(grid)), found.heading_deg), grid[1]
    ).items():
        assert of["r"] > 0.99, axis
        assert abs(of["lag_s"]) < 0.005, axis


@pytest.mark.parametrize("clock", [1.01, 0.992])
def test_a_clock_that_runs_wrong_is_found(clock):
    walk = walker(seconds=20)
    grid, video = seen(walk, "r_forearm")
    found = align(grid, video, felt(walk, "r_forearm", Faults(clock=clock)), 3.0)
    assert found.rate == pytest.approx(clock, abs=5e-4)
    assert found.lag_s == pytest.approx(0.137, abs=0.01)
    assert found.score > 0.99


def test_the_pelvis_makes_much_of_what_an_imu_feels_in_walking(walk):
    grid, video = seen(walk, "r_forearm")
    walking = (grid < walk.phases_s["walk"][1])[:, None]
    faults = Faults(lag_s=0.0)
    alone = imu_signal(strapped(walk, "r_forearm", faults), None, CUTOFF)
    assert align(grid, np.where(walking, video, np.nan), alone, 0.1).score < 0.95
    assert align(grid, np.where(walking, video, np.nan), felt(walk, "r_forearm", faults), 0.1).score > 0.99


def test_noise_bounds_the_correlation_as_it_must():
    """Two signals of one source with independent noise of equal power as the signal correlate at 1/2."""
    rng = np.random.default_rng(0)
    source = rng.standard_normal((40_000, 3))
    a, b = (source + rng.standard_normal(source.shape) for _ in range(2))
    for axis, of in agreement(a, b + np.array([0.3, -0.2, 0.1]), 0.01).items():
        if axis != "norm":
            assert of["r"] == pytest.approx(0.5, abs=0.02)
            assert of["rmse_mps2"] == pytest.approx(np.sqrt(2), abs=0.03)
            assert of["offset_mps2"] == pytest.approx({"x": 0.3, "y": -0.2, "z": 0.1}[axis], abs=0.03)
            assert of["gain"] == pytest.approx(1, abs=0.03)


def test_clip_boundaries_and_gaps_are_never_crossed(walk):
    path = point_on("r_forearm", walk.world - walk.world[:, :1]).copy()
    path[120:] += 0.3  # as a lifter's new clip may
    path[60:63] = np.nan
    grid = even_times(walk.time_s, CUTOFF)
    found = path_acceleration(path, walk.time_s, (120,), grid, CUTOFF)
    truth = point_on("r_forearm", walk.acceleration_mps2 - walk.acceleration_mps2[:, :1])
    limit = 1.5 * np.abs(truth).max()
    assert np.nanmax(np.abs(found)) < limit
    blind = path_acceleration(path, walk.time_s, (), grid, CUTOFF)
    assert np.nanmax(np.abs(blind)) > 2 * limit
    gap = (grid > walk.time_s[59]) & (grid < walk.time_s[63])
    assert np.isnan(found[gap]).all()


def test_the_pelvis_stands_while_the_arms_rise_and_not_while_walking(walk):
    grid = even_times(walk.time_s, CUTOFF)
    still = still_pelvis(walk.world - walk.world[:, :1], walk.time_s, (), grid)
    moving = np.linalg.norm(Signal(walk.time_s, walk.velocity_mps[:, 0])(grid), axis=-1)
    start, end = walk.phases_s["arms"]
    arms = (grid > start + 0.5) & (grid < end - 0.5)
    assert still[arms].all()
    assert not still[grid < walk.phases_s["walk"][1] - 1].any()
    assert np.nanmax(moving[still]) < 0.2


def test_too_little_in_common_has_words(walk):
    grid, video = seen(walk, "r_forearm")
    far = felt(walk, "r_forearm", Faults(lag_s=100.0))
    with pytest.raises(InputError, match="--offset"):
        align(grid, video, far, 5.0)
    with refused("nothing-usable"):
        align(grid, video, Signal(far.time_s, np.zeros_like(far.values)), 5.0)
    with pytest.raises(InputError, match="Nyquist"):
        path_acceleration(walk.world[:, 0], walk.time_s, (), grid, 50.0)
    with pytest.raises(InputError, match="Nyquist"):
        imu_signal(strapped(walk, "r_forearm", rate_hz=20), None, 12.0)


def test_a_sensor_at_rest_feels_gravity_alone():
    """However it is turned; what it feels beyond that is taken for an acceleration upward."""
    force = np.array([[0, 0, GRAVITY_MPS2], [0, -GRAVITY_MPS2, 0], [0, GRAVITY_MPS2 + 1.5, 0]])
    np.testing.assert_allclose(as_vertical(force), [[0, 0, 0], [0, 0, 0], [0, 0, 1.5]], atol=1e-12)


def test_a_periodic_motion_has_a_runner_up():
    time_s = np.arange(0, 20, 1 / 60)
    wave = np.stack([np.sin(2 * np.pi * time_s), np.cos(2 * np.pi * time_s), 0 * time_s], axis=-1)
    found = align(time_s, wave, Signal(time_s, wave), 3.0)
    assert found.runner_up > 0.95 * found.score
