"""Cubic splines through the rows of a path, as CubicSpline and PchipInterpolator of scipy.interpolate, whose import
takes as long as all the filtering of most takes. Sources: de Boor, A Practical Guide to Splines, chapter 4; Fritsch and
Butland, SIAM J. Sci. Stat. Comput. 5 (1984)."""

from __future__ import annotations

import numpy as np


def smooth_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The slope (N, ...) at each of the increasing x (N,) of the spline through y (N, ...) whose second derivative is
    continuous, and whose third one is behind the first and before the last of the x between ("not a knot"). Of two rows
    it is a line, of three a parabola."""
    from scipy.linalg import solve_banded

    steps = np.diff(x)
    step = steps.reshape(-1, *[1] * (y.ndim - 1))
    rise = np.diff(y, axis=0) / step
    if len(x) == 2:
        return np.concatenate([rise, rise])
    if len(x) == 3:
        middle = (step[1] * rise[0] + step[0] * rise[1]) / (step[0] + step[1])
        return np.stack([2 * rise[0] - middle, middle, 2 * rise[1] - middle])
    first, last = x[2] - x[0], x[-1] - x[-3]
    bands, right = np.zeros((3, len(x))), np.empty(y.shape)
    bands[0, 2:] = steps[:-1]
    bands[1, 1:-1] = 2 * (steps[:-1] + steps[1:])
    bands[2, :-2] = steps[1:]
    right[1:-1] = 3 * (step[1:] * rise[:-1] + step[:-1] * rise[1:])
    bands[1, 0], bands[0, 1] = steps[1], first
    right[0] = ((steps[0] + 2 * first) * steps[1] * rise[0] + steps[0] ** 2 * rise[1]) / first
    bands[1, -1], bands[2, -2] = steps[-2], last
    right[-1] = (steps[-1] ** 2 * rise[-2] + (2 * last + steps[-1]) * steps[-2] * rise[-1]) / last
    return solve_banded((1, 1), bands, right.reshape(len(x), -1), check_finite=False).reshape(y.shape)


def monotone_slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The slope (N, ...) at each of the increasing x (N,) of the spline through y (N, ...) that has no extreme between
    rows: the weighted harmonic mean of the rises on both sides, 0 where they have other signs. Of two rows it is a
    line."""
    step = np.diff(x).reshape(-1, *[1] * (y.ndim - 1))
    rise = np.diff(y, axis=0) / step
    if len(x) == 2:
        return np.concatenate([rise, rise])
    before, after = 2 * step[1:] + step[:-1], step[1:] + 2 * step[:-1]
    turns = (np.sign(rise[:-1]) != np.sign(rise[1:])) | (rise[:-1] == 0) | (rise[1:] == 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (before + after) / (before / rise[:-1] + after / rise[1:])
    ends = [
        _end_slope(step[0], step[1], rise[0], rise[1]),
        _end_slope(step[-1], step[-2], rise[-1], rise[-2]),
    ]
    return np.concatenate([ends[:1], np.where(turns, 0.0, between), ends[1:]])


def _end_slope(
    step: np.ndarray, next_step: np.ndarray, rise: np.ndarray, next_rise: np.ndarray
) -> np.ndarray:
    """Of the parabola through an end and the two rows beside it, within what keeps the spline monotone."""
    slope = ((2 * step + next_step) * rise - step * next_rise) / (step + next_step)
    steep = (np.sign(rise) != np.sign(next_rise)) & (np.abs(slope) > 3 * np.abs(rise))
    return np.where(np.sign(slope) != np.sign(rise), 0.0, np.where(steep, 3 * rise, slope))


def on_spline(x: np.ndarray, y: np.ndarray, slopes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(M, ...) at `at` (M,) of the spline through y (N, ...) at increasing x (N,) with these slopes there; outside, of
    its first and last piece."""
    left = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    shape = (-1, *[1] * (y.ndim - 1))
    step, along = (x[left + 1] - x[left]).reshape(shape), (at - x[left]).reshape(shape)
    rise = (y[left + 1] - y[left]) / step
    bend = (slopes[left] + slopes[left + 1] - 2 * rise) / step
    curve = (rise - slopes[left]) / step - bend
    return y[left] + along * (slopes[left] + along * (curve + along * (bend / step)))
