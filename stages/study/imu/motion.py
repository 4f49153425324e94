"""Accelerations for the comparison, low-passed alike on both sides: of paths of points, and of strapped sensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import is_finite
from ....pipeline.signals.filters import check_cutoff, derivative, holes, lowpass, rate, runs
from ....pipeline.signals.imu import GRAVITY_MPS2, Imu
from .align import Signal

_GRID_HZ = 120.0  # of all comparisons; lags are found between its points
_STILL = 0.2  # leg lengths a second: when both ankles move slower against the pelvis, the pelvis stands
_STILL_HZ = 2.0  # low-pass of that speed, so that an estimator's jitter is not taken for steps
_STILL_EDGE_S = 0.25  # a pelvis is still when it has been, and stays so, for that long


def even_times(time_s: np.ndarray, cutoff_hz: float) -> np.ndarray:
    """(N,) evenly spaced times from the first to the last of time_s (T,), fast enough for that cut-off."""
    grid_hz = max(_GRID_HZ, 8 * cutoff_hz)
    return time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * grid_hz) + 1) / grid_hz


def path_acceleration(
    path: np.ndarray, time_s: np.ndarray, seams: Sequence[int], grid: np.ndarray, cutoff_hz: float
) -> np.ndarray:
    """(N, 3) accelerations at even times grid (N,) of a path (T, 3) at time_s (T,), never across a gap or a
    clip boundary.

    The path is interpolated by a spline of fifth order, low-passed, and derived twice. Half a cycle of the cut-off at
    each piece's ends, where the filter has only one side, is NaN. InputError for a cut-off above the path's Nyquist.
    """
    smooth, begins = _smooth_path(path, time_s, seams, grid, cutoff_hz)
    acceleration = derivative(smooth, grid, begins, order=2)
    edge = round(0.5 / cutoff_hz / (grid[1] - grid[0]))
    return np.where(_inner(is_finite(acceleration), begins, edge)[:, None], acceleration, np.nan)


def still_pelvis(
    joints: np.ndarray, time_s: np.ndarray, seams: Sequence[int], grid: np.ndarray
) -> np.ndarray:
    """(N,) True at times grid (N,) when both ankles, and so the pelvis over them, have stood for a while.

    joints: (T, 17, 3) relative to the pelvis. A leap with legs held stiff would pass for standing.
    """
    legs = [
        _length(joints, f"{s}_hip", f"{s}_knee") + _length(joints, f"{s}_knee", f"{s}_ankle") for s in "lr"
    ]
    limit = _STILL * float(np.mean(legs))
    speeds = []
    for ankle in ("l_ankle", "r_ankle"):
        smooth, begins = _smooth_path(joints[:, H36M17.index(ankle)], time_s, seams, grid, _STILL_HZ)
        speeds.append(np.linalg.norm(derivative(smooth, grid, begins), axis=-1))
    slow = np.nan_to_num(np.maximum(*speeds), nan=np.inf) < limit
    return _inner(slow, (), round(_STILL_EDGE_S / (grid[1] - grid[0])))


def imu_signal(imu: Imu, reference: Signal | None, cutoff_hz: float) -> Signal:
    """The sensor's acceleration in the world without gravity, less the reference's, on the sensor's clock."""
    check_cutoff(cutoff_hz, imu.rate_hz)
    acceleration = lowpass(imu.acceleration_mps2, imu.time_s, cutoff_hz, holes(imu.time_s).tolist())
    if reference is not None:
        acceleration = acceleration - reference(imu.time_s)
    return Signal(imu.time_s, acceleration)


def imu_norm(imu: Imu, cutoff_hz: float) -> Signal:
    """The norm of the sensor's acceleration, gravity included, on the sensor's clock, as `as_vertical`."""
    check_cutoff(cutoff_hz, imu.rate_hz)
    force = lowpass(as_vertical(imu.force_mps2), imu.time_s, cutoff_hz, holes(imu.time_s).tolist())
    return Signal(imu.time_s, force)


def as_vertical(force: np.ndarray) -> np.ndarray:
    """(T, 3) whose z is the norm of specific force (T, 3) beyond standard gravity, so that norms are compared as
    accelerations are; to first order it is the vertical acceleration."""
    beyond = np.linalg.norm(force, axis=-1) - GRAVITY_MPS2
    return beyond[:, None] * [0.0, 0.0, 1.0]


def _smooth_path(
    path: np.ndarray, time_s: np.ndarray, seams: Sequence[int], grid: np.ndarray, cutoff_hz: float
) -> tuple[np.ndarray, tuple[int, ...]]:
    """The low-passed path (N, 3) at times grid (N,), and the rows there at which unbroken pieces begin."""
    from scipy.interpolate import make_interp_spline

    check_cutoff(cutoff_hz, rate(time_s))
    fine, begins = np.full((len(grid), 3), np.nan), []
    for piece in runs(is_finite(path), time_s, [*seams, *holes(time_s)]):  # unfiltered, a hole is not bridged
        if piece.stop - piece.start > 5:
            times = time_s[piece]
            start, stop = np.searchsorted(grid, [times[0] - 1e-9, times[-1] + 1e-9])
            fine[start:stop] = make_interp_spline(times, path[piece], k=5)(grid[start:stop])
            begins += [int(start)] if start else []
    return lowpass(fine, grid, cutoff_hz, begins), tuple(begins)


def _inner(rows: np.ndarray, begins: Sequence[int], edge: int) -> np.ndarray:
    """rows (N,) less the first and last `edge` of every unbroken piece."""
    inner = np.zeros(len(rows), dtype=bool)
    for piece in runs(rows, np.arange(len(rows), dtype=float), begins):
        inner[piece.start + edge : max(piece.stop - edge, piece.start)] = True
    return inner


def _length(joints: np.ndarray, start: str, end: str) -> float:
    bone = joints[:, H36M17.index(end)] - joints[:, H36M17.index(start)]
    return float(np.nanmedian(np.linalg.norm(bone, axis=-1)))
