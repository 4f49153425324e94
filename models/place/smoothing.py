"""A path over time from noisy places of known errors: a Gaussian smoother of the whole take at once.

The prior is white acceleration (an integrated Wiener process of the velocity), as in a Kalman smoother; a place that
is certain across the line of sight and uncertain along it is smoothed the more along it. Solved as one banded system of
normal equations; the covariances are the diagonal blocks of its inverse.
"""

from __future__ import annotations

import numpy as np

from ..common.splines import inverse_band

_ROOM = 100.0  # units that a place may be from the mean one: a weak prior, so that no gap is too long to be solved
_BAND = 6  # values that a value is tied to: the three coordinates of the next two frames


def smoothed(
    places: np.ndarray, information: np.ndarray, time_s: np.ndarray, jolt: float
) -> tuple[np.ndarray, np.ndarray]:
    """The path (T, 3), and the factor of its information, from which `covariances` gets its error.

    places: (T, 3), of which the information (T, 3, 3) is zero where they are NaN; at least two frames must have some.
    time_s: (T,) increasing. jolt: power spectral density of the acceleration, unit^2 / s^3. Gaps are bridged, and ends
    continued, at an even velocity, with an error that grows.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded

    count = len(places)
    middle = np.nanmean(places, axis=0)
    band = np.zeros((_BAND + 1, 3 * count))
    for i in range(3):
        for j in range(i + 1):
            band[i - j, j::3] = information[:, i, j]
    for offset, values in enumerate(_stiffness(time_s, jolt)):
        band[3 * offset] += np.repeat(values, 3)
    band[0] += _ROOM**-2
    off = np.where(np.isfinite(places), places - middle, 0.0)
    right = np.einsum("tij,tj->ti", information, off)
    factor = cholesky_banded(band, lower=True)
    path = cho_solve_banded((factor, True), right.ravel()).reshape(count, 3)
    return middle + path, factor


def _stiffness(time_s: np.ndarray, jolt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Diagonals 0, 1 and 2, each (T,), of the sum of squared second differences over their variances."""
    count = len(time_s)
    before, after = np.diff(time_s)[:-1], np.diff(time_s)[1:]
    middle = (before + after) / 2
    first, last = 1 / (before * middle), 1 / (after * middle)
    parts = (first, -(first + last), last)
    diagonals = np.zeros((3, count))
    for i in range(3):
        for j in range(i, 3):
            diagonals[j - i, i : i + count - 2] += middle / jolt * parts[i] * parts[j]
    return diagonals[0], diagonals[1], diagonals[2]


def covariances(factor: np.ndarray) -> np.ndarray:
    """(T, 3, 3) covariance of each place of a path of `smoothed`, by its factor."""
    diagonals = inverse_band(factor[..., None])
    blocks = np.empty((factor.shape[1] // 3, 3, 3))
    for i in range(3):
        for j in range(i + 1):
            blocks[:, i, j] = blocks[:, j, i] = diagonals[i - j][j::3, 0]
    return blocks
