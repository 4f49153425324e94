"""Filters by their gain, derivatives in closed form, pieces that nothing reaches across; ranks and means of the rows
around each are those of scipy.ndimage."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d, percentile_filter
from scipy.signal import find_peaks

from pcnet3d.pipeline import H36M17, LEVEL, InputError, PoseSequence
from pcnet3d.pipeline.signals.filters import (
    breaks,
    check_cutoff,
    derivative,
    each_path,
    even_grid,
    evenly_spaced,
    gaussian,
    holes,
    lowpass,
    monotone_slopes,
    nearest_row,
    on_spline,
    peaks,
    ranked,
    rate,
    resample,
    runs,
    smooth_slopes,
)


def gain(hz: float, fps: float, **options) -> float:
    """What is left of a long sine, away from its ends; a phase shift would lessen it too."""
    time_s = np.arange(round(20 * fps)) / fps
    sine = np.sin(2 * np.pi * hz * time_s + 0.3)
    middle = slice(len(sine) // 4, 3 * len(sine) // 4)
    return float(lowpass(sine, time_s, **options)[middle] @ sine[middle] / (sine[middle] @ sine[middle]))


def test_the_nearest_row_of_a_long_take_needs_no_table_of_all_rows_by_all_moments():
    """The marks of 640,000 frames with 20,000 steps asked for 100 GB."""
    time_s, at_s = np.arange(640_000) / 30, np.linspace(-1, 22_000, 20_000)
    assert (np.abs(time_s[nearest_row(time_s, at_s)] - np.clip(at_s, 0, time_s[-1])) <= 1 / 60 + 1e-9).all()
    uneven = np.array([0.0, 0.1, 0.5, 2.0])
    assert nearest_row(uneven, np.array([-1.0, 0.04, 0.29, 0.31, 1.3, 9.0])).tolist() == [0, 0, 1, 2, 3, 3]
    assert nearest_row(np.zeros(1), 3.0) == 0


def test_two_passes_halve_the_power_at_the_cutoff():
    for fps in [25, 30, 60, 120, 240]:
        assert gain(6.0, fps, cutoff_hz=6.0) == pytest.approx(np.sqrt(0.5), abs=2e-3)
        warped = np.tan(np.pi * 3 / fps) / np.tan(np.pi * 6 / fps)
        designed = (np.sqrt(2) - 1) * warped**4  # Butterworth's formula, each pass with half of the order
        assert gain(3.0, fps, cutoff_hz=6.0) == pytest.approx(1 / (1 + designed), abs=2e-3)


def test_pieces_know_nothing_of_each_other():
    """A gap, a clip boundary and a jump in time: each piece is filtered as if it were alone."""
    rng = np.random.default_rng(1)
    x = rng.normal(size=(120, 3)) * 0.01 + np.repeat([0.0, 5.0, -3.0, 8.0], 30)[:, None]
    x[29] = np.nan
    time_s = np.arange(120) / 30
    time_s[90:] += 1
    together = lowpass(x, time_s, seams=(60,))
    pieces = [slice(0, 29), slice(30, 60), slice(60, 90), slice(90, 120)]
    assert runs(np.isfinite(x).all(axis=1), time_s, (60,)) == pieces
    for piece in pieces:
        np.testing.assert_allclose(together[piece], lowpass(x[piece], time_s[piece]), rtol=1e-6)
        assert np.ptp(together[piece]) < 0.1
    assert np.isnan(together[29]).all()


@pytest.mark.parametrize(("rows", "filtered"), [(9, False), (10, True)])
def test_a_piece_too_short_for_the_filter_is_missing(rows, filtered):
    x = np.full(40, np.nan)
    x[5 : 5 + rows] = 1
    assert np.isfinite(lowpass(x, np.arange(40) / 30)).sum() == (rows if filtered else 0)


@pytest.mark.parametrize(
    ("cutoff_hz", "fps"), [(50, 30), (15, 30), (0, 30), (-1, 30), (np.nan, 30), (6, np.nan)]
)
def test_a_cutoff_that_the_frame_rate_does_not_carry(cutoff_hz, fps):
    with pytest.raises(InputError, match="Nyquist"):
        check_cutoff(cutoff_hz, fps)


def test_stamps_rounded_to_milliseconds_count_as_even():
    time_s = np.round(np.arange(300) / 30, 3)
    assert evenly_spaced(time_s, rate(time_s))
    jittered = np.arange(300) / 30 + np.random.default_rng(0).uniform(-0.008, 0.008, 300)
    assert not evenly_spaced(jittered, rate(jittered))


@pytest.mark.parametrize("fps", [24, 29.97, 59.94, 240])
def test_rows_of_an_even_rate_have_their_numbers_whatever_is_lost(fps):
    """A long take, whose rate has to be known to a hundredth of a frame in all of it."""
    for tick_s in [1e-9, 1 / 90_000, 1e-3]:
        rng = np.random.default_rng(3)
        rows = np.union1d([0, 1, 39_999], np.flatnonzero(rng.random(40_000) < 0.7))
        time_s = 5 + np.round(rows / fps / tick_s) * tick_s
        even_s, numbers = even_grid(time_s)
        np.testing.assert_array_equal(numbers, rows)
        np.testing.assert_allclose(even_s, 5 + np.arange(40_000) / fps, atol=1e-3)


def test_stamps_of_no_even_rate_have_no_numbers():
    rng = np.random.default_rng(4)
    assert even_grid(np.cumsum(rng.uniform(0.02, 0.045, 300))) is None
    assert even_grid(np.concatenate([np.arange(100) / 30, 100 / 30 + np.arange(100) / 50])) is None


def test_a_variable_frame_rate_is_filtered_at_its_true_times():
    """A slow motion is kept to 3 mm; with its stamps taken for even ones it would lose centimetres."""
    rng = np.random.default_rng(2)
    time_s = np.cumsum(rng.uniform(0.02, 0.045, 300))
    x = 0.3 * np.sin(2 * np.pi * time_s)
    middle = slice(20, -20)
    np.testing.assert_allclose(lowpass(x, time_s)[middle], x[middle], atol=3e-3)
    as_if_even = lowpass(x, np.arange(300) * np.median(np.diff(time_s)))
    noisy = lowpass(x + 0.01 * rng.normal(size=300), time_s)
    assert np.std((noisy - x)[middle]) < 0.8 * 0.01
    assert np.abs(as_if_even - x)[middle].max() > 2 * np.abs(lowpass(x, time_s) - x)[middle].max()


@given(
    st.lists(st.booleans(), min_size=1, max_size=40),
    st.lists(st.floats(0.01, 1.0), min_size=40, max_size=40),
    st.sets(st.integers(1, 39), max_size=4),
)
@settings(max_examples=60, deadline=None)
def test_runs_are_the_valid_rows_and_hold_no_break(valid, steps, seams):
    valid, time_s = np.array(valid), np.cumsum(steps)[: len(valid)]
    seams = {seam for seam in seams if seam < len(valid)}
    found = runs(valid, time_s, tuple(seams))
    rows = [row for piece in found for row in range(piece.start, piece.stop)]
    assert rows == np.flatnonzero(valid).tolist()
    for piece in found:
        assert not seams & set(range(piece.start + 1, piece.stop))
        if piece.stop - piece.start > 1:
            usual = np.median(np.diff(time_s))
            assert np.diff(time_s[piece]).max() <= max(2.5 * usual, usual + 0.2 + 1e-6)


@pytest.mark.parametrize(("lost_s", "bridged"), [(0.1, True), (0.2, True), (0.3, False)])
def test_a_hole_of_the_clock_is_bridged_as_long_as_a_gap_of_rows_is(lost_s, bridged):
    """Images that a phone dropped: no row is missing, and two of them lost a whole walk."""
    for fps in [30, 60, 240]:
        kept = np.delete(np.arange(4 * fps), np.arange(2 * fps, 2 * fps + round(lost_s * fps)))
        time_s = kept / fps
        assert len(runs(np.ones(len(kept), bool), time_s)) == (1 if bridged else 2)
        motion = np.sin(2 * np.pi * time_s)
        x = motion + np.random.default_rng(0).normal(scale=0.01, size=len(kept))
        middle = slice(fps // 2, -fps // 2)
        off = np.abs(lowpass(x, time_s) - motion)[middle]
        assert off.max() < 0.06  # not more beside the hole, where the noise of two rows would swing far
        assert holes(time_s).tolist() == [2 * fps]
        between = resample(motion, time_s, np.array([2 + lost_s / 2]))
        assert np.isfinite(between).all() == bridged
        assert not bridged or np.abs(between - np.sin(2 * np.pi * (2 + lost_s / 2))).max() < 0.05


def test_breaks_are_clip_boundaries_and_dropped_frames():
    index = np.r_[0:5, 9:12]
    poses = PoseSequence(
        np.zeros((8, 17, 3)), H36M17, LEVEL, time_s=index / 30, frame_index=index, seams=(2, 5)
    )
    assert breaks(poses) == (2, 5)
    assert breaks(poses.with_(seams=())) == (5,)
    every_third = poses.with_(frame_index=3 * np.arange(8), seams=())  # none dropped
    assert breaks(every_third) == ()


@pytest.mark.parametrize("uneven", [False, True])
def test_derivatives_of_a_pendulum(uneven):
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.012, 0.02, 200)) if uneven else np.arange(200) / 60
    w = 2 * np.pi * 1.5
    x = np.stack([np.sin(w * time_s), np.cos(w * time_s)], axis=-1)
    first = w * np.stack([np.cos(w * time_s), -np.sin(w * time_s)], axis=-1)
    inner = slice(4, -4)
    np.testing.assert_allclose(derivative(x, time_s)[inner], first[inner], atol=2e-3 * w)
    np.testing.assert_allclose(derivative(x, time_s, order=2)[inner], -(w**2) * x[inner], atol=5e-3 * w**2)
    np.testing.assert_allclose(derivative(x[:, 0], time_s), derivative(x, time_s)[:, 0])
    assert np.isnan(derivative(x[:2], time_s[:2])).all()


def test_no_derivative_reaches_across_a_gap_or_a_clip_boundary():
    time_s = np.arange(12.0)
    path = np.arange(12.0)[:, None].copy()
    path[6:] += 100  # a step at the clip boundary
    path[3] = np.nan
    speed = derivative(path, time_s, seams=(6,))[:, 0]
    np.testing.assert_allclose(speed[:3], 1)
    assert np.isnan(speed[3:6]).all()  # the gap itself, and a run of two rows before the clip boundary
    np.testing.assert_allclose(speed[6:], 1)


def test_resampling_meets_the_points_and_leaves_the_gaps():
    time_s = np.arange(60) / 30
    x = np.sin(3 * time_s)
    x[20:30] = np.nan
    at = np.arange(120) / 60
    found = resample(x, time_s, at)
    np.testing.assert_allclose(found[::2], x, atol=1e-12)
    inside = np.isfinite(found)
    np.testing.assert_allclose(found[inside], np.sin(3 * at[inside]), atol=1e-4)
    assert not inside[39:60].any()
    assert inside[:39].all()


def test_resampling_a_part_of_a_long_take_is_that_of_the_whole():
    """Else every stride of a long walk costs as much as the take is long."""
    time_s = np.arange(5000) / 30
    x = np.random.default_rng(0).normal(size=5000)
    for at in (np.linspace(80, 81.3, 101), np.linspace(0, 1, 101), np.linspace(166, time_s[-1], 101)):
        np.testing.assert_allclose(resample(x, time_s, at), CubicSpline(time_s, x)(at), atol=1e-9)
    at = np.linspace(80, 81.3, 101)
    cut = resample(x, time_s, at, seams=[10, 2420, 4000])  # the second lies between 80.63 and 80.67 s
    assert (
        np.flatnonzero(np.isnan(cut)).tolist() == np.flatnonzero((at > 2419 / 30) & (at < 2420 / 30)).tolist()
    )


def test_paths_that_are_filtered_together_are_as_each_alone() -> None:
    rng = np.random.default_rng(4)
    paths = rng.normal(size=(200, 4, 3)).cumsum(axis=0)
    paths[50, 1], paths[90, 2, 0] = np.nan, np.nan
    time_s = np.arange(200) / 30
    alone = np.stack([lowpass(paths[:, i], time_s) for i in range(4)], axis=1)
    assert np.array_equal(each_path(lambda path: lowpass(path, time_s), paths), alone, equal_nan=True)
    rates = np.stack([derivative(paths[:, i, 0], time_s) for i in range(4)], axis=1)
    assert np.array_equal(
        each_path(lambda path: derivative(path, time_s), paths[..., 0]), rates, equal_nan=True
    )


@given(st.lists(st.integers(-9, 9), max_size=40), st.integers(1, 6))
def test_peaks_fall_on_both_sides_as_prominent_ones_do(steps, least):
    """Of a path whose turns all have their own height."""
    x = np.cumsum([10.0, *steps]) + 1e-6 * np.arange(len(steps) + 1)
    assert peaks(x, least) == find_peaks(x, prominence=least)[0].tolist()


def test_a_plateau_is_one_peak_and_so_are_two_that_are_equally_high():
    assert peaks(np.array([0.0, 3.0, 3.0, 3.0, 0.0, 4.0, 3.0, 4.0, 0.0, 9.0]), 2.0) == [2, 5]


@pytest.mark.parametrize("rows", [2, 3, 4, 5, 300])
@pytest.mark.parametrize("shape", [(), (3,), (17, 3)])
@pytest.mark.parametrize(
    ("slopes_of", "reference"), [(smooth_slopes, CubicSpline), (monotone_slopes, PchipInterpolator)]
)
def test_curves_and_slopes_are_scipys(rows, shape, slopes_of, reference):
    rng = np.random.default_rng(rows)
    x = np.cumsum(rng.uniform(0.01, 0.1, rows))
    y = np.round(rng.normal(size=(rows, *shape)), 1)  # so coarse that neighbours are equal
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 50)])
    expected, slopes = reference(x, y), slopes_of(x, y)
    np.testing.assert_allclose(on_spline(x, y, slopes, at), expected(at), atol=1e-12)
    np.testing.assert_allclose(slopes, expected(x, 1), rtol=1e-9, atol=1e-9)


# Of numpy's name for what is beyond the ends scipy's.
BEYOND = {"edge": "nearest", "symmetric": "reflect"}


@pytest.mark.parametrize("beyond", BEYOND)
@given(rows=st.integers(10, 60), half=st.integers(0, 9), percent=st.sampled_from([20, 50]))
def test_ranks_are_those_of_scipy(beyond, rows, half, percent):
    """Of as many rows as are around one to a side: with fewer, scipy 1.17 reads memory that is none of theirs."""
    x = np.random.default_rng(rows).normal(size=rows)
    x[::7] = np.inf
    width = 2 * half + 1
    found = ranked(x, width, width * percent // 100, beyond)
    np.testing.assert_array_equal(found, percentile_filter(x, percent, size=width, mode=BEYOND[beyond]))


def test_a_long_take_has_the_ranks_of_its_rows():
    x = np.random.default_rng(0).normal(size=9000)
    np.testing.assert_array_equal(ranked(x, 13, 6, "edge"), percentile_filter(x, 50, size=13, mode="nearest"))


@given(rows=st.integers(1, 60), sd=st.floats(0.1, 20), columns=st.sampled_from([(), (3,)]))
def test_means_are_those_of_scipy(rows, sd, columns):
    x = np.random.default_rng(rows).normal(size=(rows, *columns))
    np.testing.assert_allclose(gaussian(x, sd), gaussian_filter1d(x, sd, axis=0), rtol=1e-12, atol=1e-13)
