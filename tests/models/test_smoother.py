"""A smoother that knows the error of what it smooths: paths in closed form, and bars that hold what they say."""

import tracemalloc

import numpy as np
import pytest

from pcnet3d.models.common.splines import _basis, solved
from pcnet3d.models.smoother import ERROR_S, Motion, known_noise

FPS = 30.0


def times(seconds: float, fps: float = FPS) -> np.ndarray:
    return np.arange(round(seconds * fps)) / fps


def wave(time_s: np.ndarray, hz: float, size: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    """A path (T, 1, 3) and its acceleration; one axis a quarter of a cycle behind, one still."""
    turn = 2 * np.pi * hz
    path = size * np.stack([np.sin(turn * time_s), np.cos(turn * time_s), 0 * time_s], -1)[:, None]
    return path, -(turn**2) * path


def same(time_s: np.ndarray, sd: float, joints: int = 1) -> np.ndarray:
    return np.broadcast_to(sd**2 * np.eye(3), (len(time_s), joints, 3, 3))


def drift(rng: np.random.Generator, time_s: np.ndarray, sd: float, series: int) -> np.ndarray:
    """An error (T, series) of the kind that the smoother takes a lifter's for."""
    kept = np.exp(-1 / FPS / ERROR_S)
    error = rng.normal(size=(len(time_s), series))
    for i in range(1, len(time_s)):
        error[i] = kept * error[i - 1] + np.sqrt(1 - kept**2) * error[i]
    return sd * error


@pytest.mark.parametrize("fps", [10.0, 30.0, 240.0])
def test_without_an_error_nothing_is_smoothed(fps):
    time_s = times(4, fps)
    path, _ = wave(time_s, 1.0)
    motion = known_noise(path, time_s, same(time_s, 1e-6))
    np.testing.assert_allclose(motion.values[0], path, atol=1e-5)
    assert np.sqrt(motion.variance[0]).max() < 1e-5


@pytest.mark.parametrize("fps", [30.0, 60.0])
@pytest.mark.parametrize("noise_m", [0.0, 0.02, 0.05])
def test_who_glides_keeps_place_and_speed(fps, noise_m):
    """An even path, as of a wheelchair, has so little jerk that whatever else pulls at it would move it."""
    time_s = times(10, fps)
    path = np.stack([time_s, 0 * time_s, 4 + 0 * time_s], axis=-1)[:, None]
    seen = path + noise_m * np.random.default_rng(0).normal(size=path.shape)
    motion = known_noise(seen, time_s)
    assert np.median(motion.values[1, :, 0, 0]) == pytest.approx(1.0, abs=0.01)
    assert np.abs(motion.values[0] - path).max() < 1e-6 + 1.5 * noise_m


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_who_stands_still_does_not_shake_by_the_error_of_measured_joints(fps):
    """All that such paths show is error. A tenth of it was taken for that and the rest for motion: 5 mm made
    accelerations of 20 to 40 m/s2, up to twice those of the joints as they came."""
    time_s = times(10, fps)
    found = known_noise(0.005 * np.random.default_rng(0).normal(size=(len(time_s), 4, 3)), time_s)
    speed, acceleration = (np.sqrt((found.values[i] ** 2).sum(axis=-1).mean()) for i in (1, 2))
    assert speed < 0.05
    assert acceleration < 0.5


@pytest.mark.parametrize(("fps", "most_m"), [(4.0, 0.02), (6.0, 0.04)])
def test_who_runs_is_not_taken_for_an_error_at_a_low_frame_rate(fps, most_m):
    """Seen so seldom, strides of 0.7 s and their harmonics are as good as forgotten from row to row: wrists were moved
    by 12 and 7 cm."""
    time_s = times(10, fps)
    path = sum(size * np.sin(2 * np.pi * hz * time_s + hz) for hz, size in ((1.4, 0.3), (2.8, 0.1)))
    path = np.stack([path, 0.7 * np.roll(path, 1), 0.5 * path], axis=-1)[:, None]
    assert np.sqrt(((known_noise(path, time_s).values[0] - path) ** 2).mean()) < most_m


@pytest.mark.parametrize("noise_m", [0.001, 0.003, 0.005])
def test_swaying_is_told_from_the_error_of_measured_joints(noise_m):
    """4 mm to and fro in a second: its velocity is better known than by saying that nobody moves."""
    time_s = times(10, 60.0)
    path, _ = wave(time_s, 1.0, 0.004)
    velocity = np.gradient(path, time_s, axis=0)
    found = known_noise(path + noise_m * np.random.default_rng(1).normal(size=path.shape), time_s).values[1]
    assert np.sqrt(((found - velocity) ** 2).mean()) < 0.6 * np.sqrt((velocity**2).mean())


def test_a_cycle_a_second_keeps_its_peaks_when_the_error_is_small():
    time_s = times(6)
    path, acceleration = wave(time_s, 1.0)
    rng = np.random.default_rng(0)
    seen = path + drift(rng, time_s, 0.003, 3)[:, None]
    found, true = known_noise(seen, time_s, same(time_s, 0.003)).values[2][30:150], acceleration[30:150]
    assert (found * true).sum() / (true**2).sum() == pytest.approx(1, abs=0.03)
    assert found[..., :2].max() == pytest.approx(true.max(), rel=0.15)


@pytest.mark.parametrize("sd", [0.005, 0.02])
def test_bars_hold_nine_in_ten_of_what_the_model_draws(sd):
    """A path whose jerk is white noise above half a cycle a second, as people move, and an error that is forgotten
    over ERROR_S."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(2)
    time_s, fine, leak = times(12), 20, np.pi
    step = 1 / FPS / fine
    state = [5 * rng.normal(size=((len(time_s) + 90) * fine, 60)) / np.sqrt(step)]
    for _ in range(3):
        state.append(lfilter([step], [1, -np.exp(-leak * step)], state[-1], axis=0))
    _, third, second, first = (each[90 * fine :: fine].reshape(-1, 20, 3) for each in state)
    truth = [first, second - leak * first, third - 2 * leak * second + leak**2 * first]
    seen = first + drift(rng, time_s, sd, 60).reshape(-1, 20, 3)
    motion = known_noise(seen, time_s, same(time_s, sd, 20))
    for values, variance, true in zip(motion.values, motion.variance, truth, strict=True):
        inside = np.mean(np.abs(values - true) < 1.645 * np.sqrt(variance))
        assert 0.86 < inside < 0.94


def test_what_is_less_certain_is_smoothed_more():
    """An error three times as large in depth: the same shaking is taken for motion across, and for error along."""
    time_s = times(10)
    rng = np.random.default_rng(3)
    path, _ = wave(time_s, 0.4)
    shaking = np.repeat(drift(rng, time_s, 0.03, 1)[:, None], 3, axis=2)
    covariance = np.broadcast_to(np.diag([0.01, 0.01, 0.09]) ** 2, (len(time_s), 1, 3, 3))
    found = known_noise(path + shaking, time_s, covariance)
    left = found.values[2, 30:-30, 0].std(axis=0)
    assert left[2] < 0.7 * left[1]
    sd = np.sqrt(np.einsum("dtnii->dtni", found.covariance)).mean(axis=(1, 2))
    assert (sd[:, 2] > 1.3 * sd[:, 0]).all()


def test_axes_do_not_matter():
    """The answer of a turned path is the turned answer."""
    from scipy.spatial.transform import Rotation

    time_s = times(5)
    rng = np.random.default_rng(4)
    Q = Rotation.random(random_state=4).as_matrix()
    seen = wave(time_s, 0.7)[0] + drift(rng, time_s, 0.03, 3)[:, None]
    covariance = np.broadcast_to(np.diag([0.02, 0.03, 0.08]) ** 2, (len(time_s), 1, 3, 3))
    straight = known_noise(seen, time_s, covariance)
    turned = known_noise(seen @ Q.T, time_s, Q @ covariance @ Q.T)
    np.testing.assert_allclose(turned.values, straight.values @ Q.T, atol=1e-4)
    np.testing.assert_allclose(turned.covariance, Q @ straight.covariance @ Q.T, rtol=1e-3, atol=1e-4)


def test_an_error_that_nobody_states_is_estimated():
    """White noise of 5 and of 20 mm on a walk-like path."""
    time_s = times(10)
    rng = np.random.default_rng(5)
    path = np.concatenate([wave(time_s, hz)[0] for hz in (0.5, 0.8, 1.0, 1.2)], axis=1)
    path = path + np.concatenate([wave(time_s, 2 * hz, 0.05)[0] for hz in (0.5, 0.8, 1.0, 1.2)], axis=1)
    for sd in (0.005, 0.02):
        seen = path + sd * rng.normal(size=path.shape)
        motion = known_noise(seen, time_s)
        inside = np.mean(np.abs(motion.values[0] - path) < 1.645 * np.sqrt(motion.variance[0]))
        assert 0.8 < inside <= 1
        assert np.sqrt(np.mean((motion.values[0] - path) ** 2)) < 0.7 * sd


def test_a_lift_errs_by_more_than_its_path_tells():
    """Slow motion and an error of which only the quick part can be told: for a lift more of it is taken out, and the
    bars are wider."""
    time_s = times(10)
    rng = np.random.default_rng(9)
    path, acceleration = wave(time_s, 0.4)
    seen = path + drift(rng, time_s, 0.03, 3)[:, None]
    plain, lift = (known_noise(seen, time_s, lifted=lifted) for lifted in (False, True))
    off = [
        np.sqrt(np.mean((motion.values[2, 30:-30] - acceleration[30:-30]) ** 2)) for motion in (plain, lift)
    ]
    assert off[1] < 0.8 * off[0]
    assert (np.median(lift.variance, axis=(1, 2)) > 1.5 * np.median(plain.variance, axis=(1, 2)))[0].all()


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_a_lifter_that_errs_anew_in_every_frame_and_says_by_how_much(fps):
    """No error that lasts 1.5 s shakes so. The rest of the shaking was motion: accelerations were off by 70 times what
    they are."""
    time_s = times(8, fps)
    path, acceleration = wave(time_s, 1.0)
    seen = path + 0.04 * np.random.default_rng(3).normal(size=path.shape)
    found = known_noise(seen, time_s, same(time_s, 0.04), lifted=True)
    off = (found.values[2] - acceleration)[10:-10]
    assert np.sqrt((off**2).mean()) < 0.6 * np.sqrt((acceleration**2).mean())
    assert np.mean(np.abs(off) < 1.645 * np.sqrt(found.variance[2][10:-10])) > 0.85


def test_factors_are_of_standard_deviations():
    """Of position, velocity and acceleration."""
    motion = Motion(np.zeros((3, 2, 1, 3)), np.ones((3, 2, 1, 3)), np.eye(3)).widened((1.0, 2.0, 3.0))
    np.testing.assert_allclose(np.sqrt(motion.variance[:, 0, 0, 0]), (1.0, 2.0, 3.0))


def test_bars_are_wider_across_a_gap_and_nothing_reaches_beyond_the_ends():
    time_s = times(6)
    path, _ = wave(time_s, 0.5)
    path[:5], path[80:95], path[-3:] = np.nan, np.nan, np.nan
    motion = known_noise(path, time_s, same(time_s, 0.01))
    sd = np.sqrt(motion.variance[:, :, 0, 0])
    assert np.isnan(motion.values[0, :5]).all()
    assert np.isnan(motion.values[0, -3:]).all()
    assert np.isfinite(motion.values[:, 5:-3]).all()
    assert (sd[:, 87] > 1.5 * sd[:, 50]).all()


def test_it_is_what_dense_algebra_says():
    """Of the same spline with full matrices: uneven rows, gaps, errors of different size."""
    rng = np.random.default_rng(0)
    time_s = np.arange(60) / FPS + 0.002 * rng.random(60)
    y = np.cumsum(rng.normal(size=(60, 2)), axis=0) * 0.02
    noise = (0.03 * (1 + 0.5 * rng.random((60, 2)))) ** 2
    seen = np.ones((60, 2), dtype=bool)
    seen[20:26, 0], seen[[10, 11, 40], 1] = False, False
    power = 25.0
    means, variances = solved(
        y, np.where(seen, noise, np.inf), time_s, 1 / FPS, ERROR_S, time_s[:1], np.full((1, 2), power)
    )
    place = (time_s - time_s[0]) * FPS
    left = np.floor(place + 1e-6).astype(int)
    knots = left[-1] + 4
    splines = np.zeros((60, knots))
    for i, share in enumerate(_basis(place - left, 1 / FPS)[0]):
        splines[np.arange(60), left + i] = share
    bends = np.diff(np.eye(knots), 3, axis=0)
    for i, rows in enumerate(seen.T):
        apart = np.abs(time_s[rows, None] - time_s[rows])
        sd = np.sqrt(noise[rows, i])
        inverse = np.linalg.inv(np.exp(-apart / ERROR_S) * sd[:, None] * sd)
        part = splines[rows]
        spread = np.linalg.inv(part.T @ inverse @ part + bends.T @ bends / power * FPS**5)
        np.testing.assert_allclose(
            means[0, :, i], splines @ spread @ part.T @ inverse @ y[rows, i], atol=1e-4
        )
        expected = np.einsum("ti,ij,tj->t", splines, spread, splines)
        np.testing.assert_allclose(variances[0, :, i], expected, rtol=1e-3)


def test_nothing_is_taken_across_a_break():
    time_s = times(4)
    path = np.zeros((len(time_s), 2, 3))
    path[60:] = 1.0  # a step at the clip boundary
    assert np.abs(known_noise(path, time_s, same(time_s, 0.01, 2), (60,)).values[1:]).max() < 1e-6
    assert np.abs(known_noise(path, time_s, same(time_s, 0.01, 2)).values[1:]).max() > 1


@pytest.mark.parametrize("pause_s", [0.3, 5.0, 1e5])
def test_nothing_is_taken_across_a_pause(pause_s):
    """Who stood still, elsewhere behind a hole in the time stamps, moved beside it at 0.9 m/s."""
    rng, time_s = np.random.default_rng(0), times(10)
    behind = np.arange(len(time_s)) >= 150
    path = rng.normal(0, 0.005, (len(time_s), 1, 3)) + 2.0 * behind[:, None, None]
    motion = known_noise(path, time_s + pause_s * behind)
    assert np.linalg.norm(motion.values[1], axis=-1).max() < 0.2


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 9])
def test_short_takes(rows):
    time_s = times(rows / FPS)
    path = wave(time_s, 0.2)[0]
    for covariance in (None, same(time_s, 0.02)):
        motion = known_noise(path, time_s, covariance)
        assert np.isfinite(motion.values).all() == (rows >= 3)
        if rows >= 3:
            assert np.abs(motion.values[0] - path).max() < 0.02


def test_a_long_take_is_solved_in_parts_that_nobody_sees(monkeypatch):
    time_s = times(30)
    rng = np.random.default_rng(7)
    seen = wave(time_s, 0.7)[0] + drift(rng, time_s, 0.03, 3)[:, None]
    whole = known_noise(seen, time_s, same(time_s, 0.03))
    monkeypatch.setattr("pcnet3d.models.smoother._ROWS", 200)
    parts = known_noise(seen, time_s, same(time_s, 0.03))
    for i in range(3):
        scale = np.abs(whole.values[i]).max()
        np.testing.assert_allclose(parts.values[i], whole.values[i], atol=1e-3 * scale)
        np.testing.assert_allclose(parts.variance[i], whole.variance[i], rtol=0.02)


def test_a_joint_may_be_hidden_for_longer_than_what_is_solved_at_a_time(monkeypatch):
    monkeypatch.setattr("pcnet3d.models.smoother._ROWS", 200)
    time_s = times(60)
    path = wave(time_s, 0.7)[0].repeat(2, axis=1)
    path[300:1500, 0] = np.nan
    motion = known_noise(path, time_s, same(time_s, 0.03, 2))
    assert np.isfinite(motion.values).all()
    assert motion.variance[0, 900, 0].min() > 100 * motion.variance[0, 900, 1].max()


def test_memory_of_unstated_errors_grows_with_the_length_not_its_square():
    def peak_bytes(rows):
        path = np.random.default_rng(0).normal(size=(rows, 1, 3)).cumsum(axis=0)
        tracemalloc.start()
        known_noise(path, np.arange(rows) / 30)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    assert peak_bytes(20_000) < 6 * peak_bytes(5_000)
