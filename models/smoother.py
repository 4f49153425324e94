"""Position, velocity and acceleration of paths whose error is known, each with its own error.

A path is a cubic spline; its motion and its error are Gaussian processes, and the result is the mean of the path given
the measured points, with its covariance. So a joint is smoothed by as much as its error requires: more in depth than
across it, more in a doubtful frame, less while it moves fast, and not at all without an error.

- Motion: its jerk is white noise, as in a smoothing spline, so that nothing slow is taken for an error. The size of the
  jerk comes from the spectrum of every two seconds, so that the peaks of fast motion survive.
- Error: a lifter's error changes slowly, since its input is much the same in neighbouring frames; it is an
  Ornstein-Uhlenbeck process of the stated size. If none is stated, size and correlation time are the most likely ones
  given the path: motion has hardly any power at high frequencies, so power there is error. In lifted poses that is the
  smaller part of the error, and is multiplied by a factor that was fitted where the truth is known.

Sources: Wahba, Spline Models for Observational Data, 1990, chapter 1 (splines as processes); Whittle, The analysis of
multiple stationary time series, JRSS B 15, 1953 (the likelihood of a spectrum). common/splines.py solves for the
splines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from ..pipeline.core.blocks import overlapping
from ..pipeline.core.rotations import is_finite, rotate
from ..pipeline.signals.filters import BRIDGED_S, each_path, holes, on_lines, rate
from .common.splines import solved

# Chosen on lifted takes of validation subjects (bars by pcnet3d lab evaluate errors).
ERROR_S = 1.5  # over which a lifter's error is forgotten
# A lifter blurs fast motion too: by how much true errors of its positions, velocities and accelerations (wrists and
# ankles) are larger than those of the model, so that nine in ten lie within the 90 % bars.
LIFTED = (1.6, 1.95, 1.45)
# Times the variance of the error that a lifted path shows, most of which changes as slowly as people move: if no error
# is stated, and as the least if the lifter states one, for it may be surer of itself than its path is smooth.
_SLOW_ERROR, _LEAST_ERROR = 10.0, 4.0

_FEWEST = 3  # rows that a path needs
_STILL = 1e-12  # variance of what does not move
_WINDOW_S = 2.0  # in which a joint moves alike
_KNOTS_HZ = 60.0  # at most, of the spline: people do not move faster
_ROWS = 8192  # that are solved at a time
_SETTLED_S = 4.0  # further away no row matters
_JERKS = np.geomspace(1e-3, 1e9, 41)  # power a hertz, of a take of variance 1 and seconds
_ERRORS = np.geomspace(1e-7, 0.1, 25)  # of an error's variance
# The same of an error that is forgotten from row to row, as no motion is: of a person who stands still it may be all
# the variance.
_WHITE_ERRORS = np.geomspace(1e-7, 1.0, 29)
_ERRORS_S = (0.0, 0.05, 0.2, ERROR_S)
_QUICK_HZ = 14.0  # rows a second, of fewer of which a runner's limbs look as if they were such an error
_MOST_WINDOWS = 20  # from which the error is estimated
_SHOWN = 0.7  # of a window's rows, or the line across its gaps would be taken for an error


@dataclass(frozen=True, eq=False)
class Motion:
    """Position, velocity and acceleration of J paths at T times: values (3, T, J, D), in a unit of length, and that a
    second and a second squared; variance (3, T, J, D) of their errors along axes (D, D), a direction each row."""

    values: np.ndarray
    variance: np.ndarray
    axes: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """(3, T, J, D, D) of the errors, in the axes of the values."""
        return np.einsum("ji,dtnj,jk->dtnik", self.axes, self.variance, self.axes, optimize=True)

    def of(self, path: int) -> Motion:
        """The motion of one of the paths, J = 1."""
        return Motion(self.values[:, :, [path]], self.variance[:, :, [path]], self.axes)

    def unstated(self) -> Motion:
        """The same without errors, which are NaN."""
        return Motion(self.values, np.full_like(self.variance, np.nan), self.axes)

    def widened(self, factors: tuple[float, float, float]) -> Motion:
        """The same with errors of position, velocity and acceleration larger by these factors."""
        return Motion(self.values, self.variance * np.square(factors)[:, None, None, None], self.axes)


def known_noise(
    points: np.ndarray,
    time_s: np.ndarray,
    covariance: np.ndarray | None = None,
    breaks: Sequence[int] = (),
    lifted: bool = False,
    error_s: float = ERROR_S,
) -> Motion:
    """The motion of points (T, J, D), missing ones NaN, at time_s (T,).

    covariance: (T, J, D, D) of their errors; None where nobody states it. breaks: rows at which something new begins,
    so that nothing is taken across them, nor across a hole of more than 0.2 s in the times. lifted: whether a lifter
    made the points, which errs slowly too: its error is then taken for larger than the points tell, and a covariance
    that is smaller yet for as large. error_s: over which an error that is stated is forgotten; a lifter's that shakes
    far quicker, as of one that sees each frame by itself, from row to row; below 14 rows a second that cannot be told
    from motion, and less is taken for error. Between two seen rows missing ones have values too, with the error that
    they have; before the first and behind the last one, and in pieces of fewer than 3 seen rows, they are NaN.
    """
    T, J, D = points.shape
    axes = np.eye(D)
    # What happens in a pause is no motion of the rows beside it; and a spline through one of a day fills the memory.
    breaks = (*breaks, *holes(time_s, BRIDGED_S).tolist())
    if covariance is not None:
        stated = np.isfinite(covariance).all(axis=(-2, -1))
        axes = np.linalg.eigh(covariance[stated].mean(axis=0))[1].T if stated.any() else axes
    y = rotate(axes, points.astype(np.float64))
    answer = np.full((2, 3, T, J, D), np.nan, np.float32)
    visible = np.asarray(is_finite(y))
    if visible.sum() < _FEWEST:
        return Motion(answer[0], answer[1], axes)
    size = max(
        float(np.mean([y[rows, i].var(axis=0).mean() for i, rows in enumerate(visible.T) if rows.any()])),
        _STILL,
    )
    quick = rate(time_s) >= _QUICK_HZ
    if covariance is None:
        # A tenth of a lifted path's variance is all of it, times that factor.
        white = _WHITE_ERRORS if quick and not lifted else _ERRORS
        noise, error_s = _unstated(y, time_s, size, breaks, white=white)
        noise = _SLOW_ERROR * noise if lifted else noise
    else:
        noise = np.einsum("ij,tnjk,ik->tni", axes, covariance, axes, optimize=True)
        stated = np.isfinite(noise).all(axis=-1)
        usual = [
            noise[rows, i].mean(axis=0) if rows.any() else np.zeros(D) for i, rows in enumerate(stated.T)
        ]
        noise = np.where(stated[..., None], noise, np.array(usual))
        if lifted:
            least = _unstated(y, time_s, size, breaks, (error_s,))[0][0]
            # The most that an error may be which is forgotten so slowly.
            too_quick = least.max() > 0.99 * size * _ERRORS[-1]
            least = _LEAST_ERROR * least
            if quick and too_quick:
                quick_noise, quick_s = _unstated(y, time_s, size, breaks)
                if quick_s == 0:
                    least, error_s = _SLOW_ERROR * quick_noise[0], quick_s
            noise = noise * np.maximum(1, least / np.maximum(usual, 1e-9 * size))
    noise = np.maximum(noise, 1e-9 * size)
    for piece in _pieces(T, breaks):
        _smooth(y[piece], noise[piece], time_s[piece], error_s, size, answer[:, :, piece])
    for order in range(3):
        answer[0, order] = rotate(axes.T, answer[0, order])
    return Motion(answer[0], answer[1], axes)


def _pieces(rows: int, breaks: Sequence[int]) -> list[slice]:
    edges = sorted({0, rows, *(int(row) for row in breaks)})
    return [slice(start, stop) for start, stop in pairwise(edges)]


def _smooth(
    y: np.ndarray, noise: np.ndarray, time_s: np.ndarray, error_s: float, size: float, answer: np.ndarray
) -> None:
    """Values and variances of one piece y (T, J, D) into answer (2, 3, T, J, D); noise: (T, J, D), variances."""
    T, _, D = y.shape
    visible = np.asarray(is_finite(y))
    fine = visible.sum(axis=0) >= _FEWEST
    if not fine.any():
        return
    y, noise, visible = y[:, fine], noise[:, fine], visible[:, fine]
    line, slope = _line(y, visible, time_s)
    y = y - line
    dt = 1 / rate(time_s)
    at, jerk = _jerks(each_path(partial(on_lines, at=time_s), y), noise, time_s, dt, error_s, size)
    knot_s = max(dt, 1 / _KNOTS_HZ)
    row = np.arange(T)[:, None]
    first, last = visible.argmax(axis=0), T - 1 - visible[::-1].argmax(axis=0)
    between = ((row >= first) & (row <= last))[..., None]
    around = round(_SETTLED_S / dt)
    for kept, rows, inside in overlapping(T, _ROWS, around):
        answers = solved(
            y[rows].reshape(rows.stop - rows.start, -1),
            np.where(visible[rows, :, None], noise[rows], np.inf).reshape(rows.stop - rows.start, -1),
            time_s[rows], knot_s, error_s, at, np.repeat(jerk, D, axis=1),
        ).reshape(2, 3, -1, *y.shape[1:])[:, :, inside]  # fmt: skip
        answers[0, 0] += line[kept]
        answers[0, 1] += slope
        answer[:, :, kept, fine] = np.where(between[kept], answers, np.nan)


def _line(y: np.ndarray, visible: np.ndarray, time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(T, J, D) the straight line nearest to the seen rows (T, J) of y (T, J, D), and its slope (J, D)."""
    weight = (visible / visible.sum(axis=0))[..., None]
    off = time_s[:, None, None] - (weight * time_s[:, None, None]).sum(axis=0)
    shown = np.where(visible[..., None], y, 0.0)
    slope = (weight * off * shown).sum(axis=0) / (weight * off**2).sum(axis=0)
    return (weight * shown).sum(axis=0) + slope * off, slope


def _jerks(
    y: np.ndarray, noise: np.ndarray, time_s: np.ndarray, dt: float, error_s: float, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Times (W,), and there the power (W, J) of each joint's jerk along an axis: its mean given the spectra of windows.
    All standard deviations are equally likely beforehand, so that where the error hides the motion it may be
    anything up to that, and not nothing."""
    hz, power, at = _spectra(y, time_s, dt)
    jerks = size * _JERKS
    errors = _error_density(hz, dt, error_s)[:, None, None] * noise.mean(axis=0)
    expected = jerks[:, None, None, None] * _motion_density(hz, dt)[:, None, None] + errors  # (S, F, J, D)
    score = np.einsum("wfnd,sfnd->swn", power, 1 / expected, optimize=True)
    score += np.log(expected).sum(axis=(1, 3))[:, None]
    weight = np.exp(score.min(axis=0) - score) * np.sqrt(jerks)[:, None, None]
    return at, np.einsum("swn,s->wn", weight, jerks) / weight.sum(axis=0)


def _unstated(
    y: np.ndarray,
    time_s: np.ndarray,
    size: float,
    breaks: Sequence[int],
    errors_s: Sequence[float] = _ERRORS_S,
    white: np.ndarray = _ERRORS,
) -> tuple[np.ndarray, float]:
    """Variances (T, J, D) of errors that nobody states, one a joint and axis, and their correlation time, one of
    errors_s, by maximum likelihood of the spectra of the take's windows. white: (E,) what they may be, as shares of
    `size`, where that time is 0."""
    pieces = [piece for piece in _pieces(len(y), breaks) if piece.stop - piece.start >= 8]
    none = np.full(y.shape, 1e-9 * size)
    windows = []
    for piece in pieces:
        part, visible = y[piece], np.isfinite(y[piece]).all(axis=-1)
        if not (np.isfinite(part).all(axis=-1).sum(axis=0) >= _FEWEST).all():
            part = np.where(np.isfinite(part).any(axis=0), part, 0.0)
        hz, power, at = _spectra(
            each_path(partial(on_lines, at=time_s[piece]), part), time_s[piece], 1 / rate(time_s)
        )
        first = np.searchsorted(time_s[piece], at - _WINDOW_S / 2)
        stop = np.searchsorted(time_s[piece], at + _WINDOW_S / 2, side="right")
        so_far = np.concatenate([np.zeros((1, y.shape[1]), dtype=int), visible.cumsum(axis=0)])
        windows.append((hz, power, (so_far[stop] - so_far[first]) / np.maximum(stop - first, 1)[:, None]))
    if not windows:
        return none, 0.0
    longest = max(len(hz) for hz, _, _ in windows)
    hz = next(hz for hz, _, _ in windows if len(hz) == longest)
    power, shown = (
        np.concatenate([window[i] for window in windows if len(window[0]) == longest]) for i in (1, 2)
    )
    some = np.unique(np.linspace(0, len(power) - 1, _MOST_WINDOWS).astype(int))
    power, counts = power[some], (shown[some] >= _SHOWN)[..., None]
    dt = 1 / rate(time_s)
    motion = size * _JERKS[:, None] * _motion_density(hz, dt)  # (S, F)
    best, chosen = np.inf, (none, 0.0)
    for error_s in errors_s:
        shares = _ERRORS if error_s > 0 else white
        error = size * shares[:, None] * _error_density(hz, dt, error_s)
        expected = motion + error[:, None]  # (E, S, F)
        score = np.einsum("wfnd,esf->eswnd", power, 1 / expected, optimize=True)
        score += np.log(expected).sum(axis=-1)[..., None, None, None]
        score = np.where(counts, score.min(axis=1), 0.0).sum(axis=1)  # (E, J, D)
        if score.min(axis=0).sum() < best:
            best = score.min(axis=0).sum()
            chosen = np.broadcast_to(size * shares[score.argmin(axis=0)], y.shape), error_s
    return chosen


def _spectra(y: np.ndarray, time_s: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies (F,), power (W, F, ...) of half overlapping windows of y (T, ...), whose mean over frequencies is the
    variance, and their middles' times (W,). A straight line is taken out of each, and so the lowest frequency."""
    rows = max(round((time_s[-1] - time_s[0]) / dt) + 1, 2)
    grid = np.linspace(time_s[0], time_s[-1], rows)
    if rows != len(y) or np.abs(grid - time_s).max() > 0.02 * dt:
        below = np.clip(np.searchsorted(time_s, grid, side="right") - 1, 0, len(y) - 2)
        share = (grid - time_s[below]) / (time_s[below + 1] - time_s[below])
        share = share.reshape(-1, *[1] * (y.ndim - 1))
        y = (1 - share) * y[below] + share * y[below + 1]
    length = min(max(round(_WINDOW_S / dt), 8), rows)
    starts = np.arange(0, rows - length + 1, max(length // 2, 1))
    if starts[-1] + length < rows:
        starts = np.r_[starts, rows - length]
    taper = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    taper /= np.sqrt((taper**2).sum())
    line = np.stack([np.ones(length), np.arange(length) - (length - 1) / 2])
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    power = []
    for start in starts:
        part = y[start : start + length].reshape(length, -1)
        part = part - line.T @ (line @ part)
        power.append(np.abs(np.fft.rfft(part * taper[:, None], axis=0)[2:]) ** 2)
    hz = np.fft.rfftfreq(length, dt)[2:]
    return hz, np.array(power).reshape(len(starts), len(hz), *y.shape[1:]), grid[starts] + length / 2 * dt


def _motion_density(hz: np.ndarray, dt: float) -> np.ndarray:
    """(F,) of a motion whose jerk has a power of 1 a hertz, as `_spectra` has it."""
    return (2 * np.pi * hz) ** -6.0 / dt


def _error_density(hz: np.ndarray, dt: float, error_s: float) -> np.ndarray:
    """(F,) of an error of variance 1 that is forgotten over error_s, seen every dt."""
    kept = np.exp(-dt / error_s) if error_s > 0 else 0.0
    return (1 - kept**2) / np.abs(1 - kept * np.exp(-2j * np.pi * hz * dt)) ** 2
