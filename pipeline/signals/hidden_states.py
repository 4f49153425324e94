"""The likeliest sequence of hidden states in which rows are wrong in some ways, and how probable each is.

A row is expected from the two before it, so what a state costs depends on those of three rows in a row.
"""

from __future__ import annotations

import numpy as np

# Vectors are weighed as if hardly independent; with twice the log-likelihood, the runs that are called 50 to 80 %
# probable are right in about half of the cases, the others in 99 of 100 (CMU and ACCAD val subjects).
SHARPNESS = 2.0
_ROWS = 48  # whose costs are made at once: so few that BLAS shares them among no threads, which would wait


def decoded(
    continuity: np.ndarray, cost: np.ndarray, states: np.ndarray, price: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(T,) index of each row's state in the likeliest sequence (Viterbi); over all sequences (forward-backward, Baum et
    al. 1970) (T, K) how probable each row is wrong in each way, and (T, K) how probable that has changed since the row
    before; both 0 where the likeliest sequence has nothing wrong, and so asks for neither. continuity: (T, K, 2, 2) of
    each way; cost: (T, S), 0 in state 0, in which nothing is wrong; states: (S, K); price: (S, S) of going from one to
    another, infinite where that cannot be.

    The hidden state is that of two rows, because a row is expected from the two before it.
    """
    rows, count = cost.shape
    changed = states[:, None] ^ states
    # Three rows in a row, (3, N) states, and which of a way's four costs applies to them, (4 K, N).
    allowed = np.isfinite(price)
    triples = np.nonzero(allowed[:, :, None] & allowed)
    first_two, last_two = changed[triples[:2]], changed[triples[1:]]
    pick = np.eye(4)[2 * first_two + last_two].reshape(len(triples[0]), -1).T
    prices = price[triples[1:]]
    steps = continuity.reshape(rows, -1)

    def costs(first: int, end: int) -> np.ndarray:
        """(end - first, S, S, S) of rows whose states, with the two before them, are these."""
        found = np.full((end - first, count, count, count), np.inf)
        found[:, *triples] = steps[first:end] @ pick + prices + cost[first:end, triples[2]]
        return found

    def cheapest(first: int, end: int, total: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        """Costs (S, S) of the cheapest sequences up to each row before `end`, beginning with `total`, those up to row
        first - 1; and the rows' own costs."""
        totals, own = [total], costs(first, end)
        for step in own:
            totals.append(np.minimum.reduce(totals[-1][:, :, None] + step))
        return totals, own

    def reached(first: int, end: int, share: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        """As `cheapest`, probabilities over all sequences up to each row, and the rows' own weights."""
        shares, own = [share], _weights(costs(first, end))
        for step in own:
            both = np.add.reduce(shares[-1][:, :, None] * step)
            shares.append(both / both.sum())
        return shares, own

    # Of all rows only each part's beginning is kept; what lies between is made again on the way back.
    parts = [(first, min(first + _ROWS, rows)) for first in range(2, rows, _ROWS)]
    totals = [price[0][:, None] + price + cost[0][:, None] + cost[1]]
    for part in parts:
        totals.append(cheapest(*part, totals[-1])[0][-1])
    ending = np.broadcast_to(price[0], price.shape)  # or the part behind a change would be wrong more cheaply
    path = np.zeros(rows, dtype=int)
    path[-2:] = np.unravel_index(int((totals[-1] + ending).argmin()), price.shape)
    likely, turned = np.zeros((rows, states.shape[1])), np.zeros((rows, states.shape[1]))
    # What is right throughout costs nothing, and nothing costs less.
    if not path.any() and totals[-1][0, 0] == 0:
        return path, likely, turned
    for (first, end), total in zip(reversed(parts), totals[-2::-1], strict=True):
        before, own = cheapest(first, end, total)
        for t in range(end - 1, first - 1, -1):
            i, j = path[t - 1 : t + 1]
            path[t - 2] = (before[t - first][:, i] + own[t - first][:, i, j]).argmin()
    if not path.any():
        return path, likely, turned
    shares = [_weights(totals[0])]
    for part in parts:
        shares.append(reached(*part, shares[-1])[0][-1])
    backward = _weights(ending)
    for (first, end), share in zip(reversed(parts), shares[-2::-1], strict=True):
        forward, own = reached(first, end, share)
        behind = [backward]
        for step in own[::-1]:
            both = np.einsum("ijk,jk->ij", step, behind[-1])
            behind.append(both / both.sum())
        backward = behind.pop()
        likely[first:end], turned[first:end], _ = _judged(forward[1:], behind[::-1], states, changed)
    likely[1:2], turned[1:2], likely[:1] = _judged([shares[0]], [backward], states, changed)
    return path, likely, turned


def _judged(
    forward: list[np.ndarray], backward: list[np.ndarray], states: np.ndarray, changed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of rows with these probabilities (S, S) each, (N, K) how probable they are wrong, (N, K) how probable that has
    changed since the row before, and (N, K) how probable the row before is wrong."""
    both = np.array(forward) * np.array(backward)
    both /= both.sum(axis=(1, 2), keepdims=True)
    return both.sum(axis=1) @ states, np.tensordot(both, changed), both.sum(axis=2) @ states


def _weights(cost: np.ndarray) -> np.ndarray:
    """Probabilities of these costs (S, S), or of each row's (N, S, S, S), up to a factor of each."""
    least = cost.min(axis=(-3, -2, -1)[-min(cost.ndim, 3) :], keepdims=True)
    return np.exp(SHARPNESS * (least - cost))
