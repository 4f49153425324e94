"""Cubic splines through many series at once, whose jerk and whose errors are Gaussian processes; and what such banded
systems tell of their errors.

Source: Rue & Held, Gaussian Markov Random Fields, 2005, chapter 2 (banded precisions, variances out of a Cholesky
factor).
"""

from __future__ import annotations

import numpy as np

_GOES_ON_S = 0.5  # the longest gap behind which an error goes on; behind a longer one it begins anew


def solved(
    y: np.ndarray,
    noise: np.ndarray,
    time_s: np.ndarray,
    knot_s: float,
    error_s: float,
    at: np.ndarray,
    jerk: np.ndarray,
) -> np.ndarray:
    """(2, 3, T, N): means and variances of value, first and second derivative of N series y (T, N) at time_s (T,).

    noise: (T, N) variances, infinite where nothing was seen. jerk: (W, N), its power at times `at` (W,).
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded

    T, N = y.shape
    place = (time_s - time_s[0]) / knot_s
    left = np.floor(place + 1e-6).astype(int)
    basis = _basis(place - left, knot_s)
    n = int(left[-1]) + 4
    precision, pull = _observed(y, noise, time_s, left, basis[0], error_s)

    # Third differences of the knots are the jerk between them.
    middle = time_s[0] + (np.arange(n - 3) + 0.5) * knot_s
    logs = np.log(jerk)
    strength = np.stack([np.interp(middle, at, logs[:, i]) for i in range(N)], axis=-1)
    strength = np.exp(-strength) / knot_s**5
    differences = (-1, 3, -3, 1)
    for i in range(4):
        for j in range(i, 4):
            precision[j - i, i : i + n - 3] += differences[i] * differences[j] * strength
    # Where nothing else says anything; no more, for the jerk's part is large where a path is smooth.
    precision[0] += 1e-13 * precision[0].max(axis=0)

    factor, means = np.empty_like(precision), np.empty((n, N))
    for i in range(N):
        own_factor = cholesky_banded(precision[..., i], lower=True, check_finite=False)
        factor[..., i] = own_factor
        means[:, i] = cho_solve_banded((own_factor, True), pull[:, i], check_finite=False)
    spread = inverse_band(factor)
    result = np.zeros((2, 3, T, N))
    for i in range(4):
        value, own = means[left + i], spread[0][left + i]
        for d in range(3):
            result[0, d] += basis[d, i, :, None] * value
            result[1, d] += basis[d, i, :, None] ** 2 * own
        for j in range(i + 1, 4):
            shared = spread[j - i][left + i]
            for d in range(3):
                result[1, d] += 2 * (basis[d, i] * basis[d, j])[:, None] * shared
    return result


def _observed(
    y: np.ndarray, noise: np.ndarray, time_s: np.ndarray, left: np.ndarray, basis: np.ndarray, error_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """What N series y (T, N) say about n knots: a precision (B + 1, n, N), lower banded; and it times the mean (n, N).

    left: (T,) the first knot of each row; basis: (4, T) its four splines. noise: as that of `solved`.
    """
    from scipy.sparse import coo_array, csr_array, diags_array

    N, n = y.shape[1], int(left[-1]) + 4
    series, rows = np.nonzero(np.isfinite(noise).T)  # one behind the other: one product does for all
    weight = 1 / np.sqrt(noise[rows, series])
    # Rows that are independent of each other: each less what of its error the one before already had.
    kept = np.append(0.0, _kept(series, rows, time_s, left, error_s))[: len(rows)]
    own = weight / np.sqrt(1 - kept**2)
    others = own[1:] / weight[1:] * kept[1:] * weight[:-1]
    apart = diags_array(own) - diags_array(others, offsets=-1)
    knots = (series * n + left[rows])[:, None] + np.arange(4)
    splines = csr_array(
        (basis.T[rows].ravel(), knots.ravel(), np.arange(0, knots.size + 1, 4)), shape=(len(rows), N * n)
    )
    observed = apart @ splines
    products = coo_array(observed.T @ observed)
    below = products.row >= products.col
    values, column = products.data[below], products.col[below]
    offset = products.row[below] - column
    precision = np.zeros((max(3, int(offset.max(initial=0))) + 1, n, N))
    precision[offset, column % n, column // n] = values
    pull = observed.T @ (apart @ y[rows, series])
    return precision, pull.reshape(N, n).T


def _kept(
    series: np.ndarray, rows: np.ndarray, time_s: np.ndarray, left: np.ndarray, error_s: float
) -> np.ndarray:
    """(M - 1,) how much of its error each of the seen rows (M,) of series (M,) but the first shares with the one
    before: none of another series, and none behind a longer gap, for there it costs too much to say."""
    if error_s == 0:
        return np.zeros(max(len(rows) - 1, 0))
    apart_s = np.where(np.diff(series) == 0, np.diff(time_s[rows]), np.inf)
    neighbours = (np.diff(rows) == 1) & (np.diff(left[rows]) <= 2)
    return np.where(neighbours | (apart_s <= _GOES_ON_S), np.exp(-apart_s / error_s), 0.0)


def _basis(u: np.ndarray, knot_s: float) -> np.ndarray:
    """(3, 4, T): the four cubic B-splines that are not 0 at a share u (T,) of an interval, and their derivatives."""
    v, none = 1 - u, np.zeros_like(u)
    values = [v**3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3]
    slopes = [-(v**2), 3 * u**2 - 4 * u, -3 * u**2 + 2 * u + 1, u**2]
    bends = [v, 3 * u - 2, 1 - 3 * u, u + none]
    return np.stack([np.array(values) / 6, np.array(slopes) / (2 * knot_s), np.array(bends) / knot_s**2])


def inverse_band(factor: np.ndarray) -> list[np.ndarray]:
    """Of N matrices (K, K) by their Cholesky factors (B + 1, K, N) in lower banded form: the diagonals 0 to 3 of their
    inverses, (K, N) each, entry p that of row p + diagonal and column p. From the end by blocks of B (Takahashi, Fagan
    & Chin, Formation of a sparse bus impedance matrix, 1973)."""
    width, n, N = factor.shape
    size = width - 1
    blocks = -(-n // size)
    padded = np.zeros((width, (blocks + 1) * size, N))
    padded[0] = 1.0
    padded[:, :n] = factor
    own, below = np.zeros((2, blocks, N, size, size))
    columns = padded[:, : blocks * size].reshape(width, blocks, size, N)
    for column in range(size):
        for offset in range(width):
            values = columns[offset, :, column]
            row = column + offset
            (own if row < size else below)[:, :, row % size, column] = values
    inverse = np.zeros_like(own)
    for i in range(size):
        inverse[..., i, i] = 1 / own[..., i, i]
        if i:
            past = own[..., i, None, :i] @ inverse[..., :i, :i]
            inverse[..., i, :i] = -past[..., 0, :] * inverse[..., i, i, None]
    local = np.swapaxes(inverse, -1, -2) @ inverse
    chain = below @ inverse
    by_block = np.zeros((blocks, N, 2 * size, size))
    after = np.zeros((N, size, size))
    for i in range(blocks - 1, -1, -1):
        across = -after @ chain[i]
        after = local[i] - np.swapaxes(chain[i], -1, -2) @ across
        by_block[i, :, :size], by_block[i, :, size:] = after, across
    column = np.arange(size)
    return [
        np.moveaxis(by_block[:, :, column + offset, column], 1, 2).reshape(blocks * size, N)[:n]
        for offset in range(4)
    ]
