"""The rhythm in which a walker's legs, or arms, change places, read without knowing which one is the left.

The vector from one side to the other swings to and fro once a stride. Its square is the same when the two are exchanged
and swings once a step; half the phase of that is the phase of the stride. So a row shows whether its sides are as the
rest of the walk has them, also where a crossing is too blurred to follow.
"""

from __future__ import annotations

import numpy as np

from .filters import stretches

_STEPS_HZ = np.geomspace(0.7, 4.0, 60)  # of steps of 0.25 to 1.4 s
_LEAST_ROWS = 4  # in a step: its square would not be seen to swing
_DEPTH = 0.5  # of the square's swing over its mean: 1 when the sides change places wholly, less when one stays ahead
_WINDOW = 4.0  # standard deviations after which a Gaussian window ends
_NOTHING = 1e-12  # of the largest mean: rounding, where nothing was seen
_AT_ONCE = 2**16  # rows times rates whose rhythm is taken at once; fits the caches
_FEWEST = 3.0  # steps in a walk, as in models/gait/events.py
# Agreement: the share of a walk's rows that fit, less that of those that do not. It is about 1 when people walk, below
# 0.5 when they hop or bow, which swings the square without alternating (CMU and ACCAD val subjects: few between).
AGREED = 0.7


def alternation(vectors: np.ndarray, times: np.ndarray, agreed: float = AGREED) -> np.ndarray:
    """(T,) how well each row's sides fit the rhythm, from 1 (widest apart, as the rhythm has them) by 0 (crossing, or
    no walk) to -1 (widest apart, and exchanged).

    vectors: (T, M, D) from joints of one side to those of the other, NaN where missing. times: (T,) s, about evenly
    spaced. agreed: the least agreement for a walk. A rhythm does not tell which side is the left: in each walk most
    rows are taken for right.
    """
    fits = np.zeros(len(times))
    flat = np.nan_to_num(vectors.astype(np.float64)).reshape(len(times), -1)
    # Along the direction in which they are longest.
    swing = flat @ np.linalg.svd(flat, full_matrices=False)[2][0]
    frame_s = float(np.median(np.diff(times)))
    step_s = 1 / _STEPS_HZ
    rates = _STEPS_HZ[(step_s >= _LEAST_ROWS * frame_s) & (step_s <= np.ptp(times) / _FEWEST)]
    if not len(rates) or not swing.any():
        return fits
    together = max(_AT_ONCE // len(times), 1)  # rates
    parts = (rates[first : first + together] for first in range(0, len(rates), together))
    swung = [np.abs(_rhythm(swing**2, times, part, frame_s)[1]).sum(axis=1) for part in parts]
    hz = float(rates[np.argmax(np.concatenate(swung))])
    mean, turn = (found[0] for found in _rhythm(swing**2, times, np.array([hz]), frame_s))
    phase = np.pi * hz * times + np.unwrap(np.angle(turn)) / 2
    known = mean > _NOTHING * mean.max()
    fits[known] = np.cos(phase[known]) * swing[known] / np.sqrt(2 * mean[known])
    fits = np.clip(fits, -1, 1)
    walking = known & (2 * np.abs(turn) >= _DEPTH * mean)
    walks = np.zeros(len(times))
    for first, end in stretches(walking):
        walk = fits[first:end]
        agreement = float((walk * np.abs(walk)).sum() / (walk**2).sum())
        if times[end - 1] - times[first] >= _FEWEST / hz and abs(agreement) >= agreed:
            walks[first:end] = np.sign(agreement)
    return walks * fits


def _rhythm(
    square: np.ndarray, times: np.ndarray, hz: np.ndarray, frame_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N, T) mean of the square (T,) about each row, and the complex amplitude (N, T) with which it swings at about
    each of the rates hz (N,), within a Gaussian window of a step's length as standard deviation."""
    rows = len(square)
    width = 1 / (hz[:, None] * frame_s)
    reach = int(_WINDOW * width.max()) + 1
    # With zeros enough that the ends do not meet, and of small factors, of which the transform is quick.
    least = max(rows, reach + 1) + reach
    eighth = max(2 ** (int(np.ceil(np.log2(least))) - 3), 1)
    size = -(-least // eighth) * eighth
    lag = np.arange(reach + 1)
    half = np.where(lag <= _WINDOW * width + 0.5, np.exp(-0.5 * (lag / width) ** 2), 0.0)
    window = np.zeros((len(hz), size))
    window[:, : reach + 1], window[:, -reach:] = half, half[:, :0:-1]
    gain = np.fft.rfft(window).real  # the window is even

    def smooth(x: np.ndarray) -> np.ndarray:
        return np.fft.irfft(np.fft.rfft(x, size) * gain, size)[:, :rows]

    weight = smooth(np.ones(rows))
    mean = smooth(square) / weight
    swing = (square - mean) * np.exp(-2j * np.pi * hz[:, None] * times)
    return mean, (smooth(swing.real) + 1j * smooth(swing.imag)) / weight
