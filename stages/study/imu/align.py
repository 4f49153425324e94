"""Two clocks and two headings brought together: the lag, the rate and the turn at which an IMU fits a video best.

Both sides are accelerations (T, 3) with z up, low-passed alike, NaN where unknown. What is maximised is their
correlation over the three axes at once. For a given lag the best heading has a closed form: with the horizontal
parts as complex numbers it is the angle of sum(conj(imu) video), and the correlation's horizontal part its length.
So the lag is found by one Fourier transform for all headings, and no peak is missed between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.rotations import is_finite
from ....pipeline.signals.filters import holes, runs
from ..compare.align import LEAST_SHARE, runner_up
from ..compare.figures import correlation
from ..compare.side import LEAST_S

_SEARCH_HZ = 30.0  # of the first search; signals low-passed at 6 Hz lose nothing
_RATES = 150  # clock rates tried on either side of 1
_RATE_SPAN = 0.02  # how far from 1 a clock may be, for takes short enough to try that many
_APART_S = 0.04  # by how much neighbouring rates part at the take's ends, against its middle
_RATE_GAIN = 0.005  # correlation that another rate must add to be believed
_LEAST_MPS2 = 1e-6  # that an IMU's acceleration changes by; any real one's noise is more
_STILL_MPS2 = 1e-6  # standard deviation along an axis without motion
_AXIS_S = 0.25  # how far each axis' own lag may lie from the take's


@dataclass(frozen=True)
class Alignment:
    """imu time = video time + lag_s + (rate - 1) (video time - start_s); video heading = imu's + heading_deg.

    lag_s: by how much the IMU's stamps are later at the video's beginning. rate: its seconds per second of video.
    score: the correlation over three axes. runner_up: of the best lag elsewhere, at that rate; a periodic motion
    comes near its score.
    """

    lag_s: float
    rate: float
    start_s: float
    heading_deg: float
    score: float
    runner_up: float

    def imu_time(self, time_s: np.ndarray) -> np.ndarray:
        return self.start_s + self.lag_s + (time_s - self.start_s) * self.rate


class Signal:
    """Samples (T, 3) at time_s (T,) as a continuous function, NaN outside and in gaps, short ones too: an
    acceleration says little about the one 0.2 s later."""

    def __init__(self, time_s: np.ndarray, values: np.ndarray) -> None:
        from scipy.interpolate import CubicSpline

        self.time_s, self.values = time_s, values
        self._pieces = [
            (time_s[piece][0], time_s[piece][-1], CubicSpline(time_s[piece], values[piece]))
            for piece in runs(is_finite(values), time_s, holes(time_s).tolist())
            if piece.stop - piece.start >= 4
        ]

    def __call__(self, time_s: np.ndarray) -> np.ndarray:
        """(N, 3) at increasing times (N,)."""
        result = np.full((len(time_s), 3), np.nan)
        for start, stop, spline in self._pieces:
            inside = slice(*np.searchsorted(time_s, [start - 1e-9, stop + 1e-9]))
            result[inside] = spline(time_s[inside])
        return result


def align(time_s: np.ndarray, video: np.ndarray, imu: Signal, search_s: float) -> Alignment:
    """The best alignment of video accelerations (T, 3) at even times (T,) with an IMU's, lag within +-search_s.

    InputError when less than a second of motion is known to both, or when the IMU feels none.
    """
    from scipy.optimize import minimize

    felt = imu.values[is_finite(imu.values)]
    if len(felt) and float(np.ptp(felt, axis=0).max()) < _LEAST_MPS2:
        raise InputError(
            "nothing-usable",
            "Expected an IMU whose acceleration changes, got one that stays the same throughout: it did not move, or "
            "its file was given for two segments, of which one is subtracted from the other.",
        )
    step = float(time_s[1] - time_s[0])
    stride = max(1, round(1 / (_SEARCH_HZ * step)))
    length = float(time_s[-1] - time_s[0])
    span = min(_RATE_SPAN, _RATES * 2 * _APART_S / length)
    count = int(span * length / (2 * _APART_S))
    rates = 1 + np.arange(-count, count + 1) * 2 * _APART_S / length
    coarse = [_scores(time_s[::stride], video[::stride], imu, search_s, rate) for rate in rates]
    lags, scores = coarse[count]
    if not np.isfinite(scores).any():
        raise InputError("files-apart", _no_overlap(time_s[is_finite(video)], imu, search_s))

    def fit(rate: float, lags: np.ndarray, scores: np.ndarray, free_rate: bool) -> tuple[float, float, float]:
        """Score, lag and rate at the top near a coarse peak."""
        lag = float(lags[np.nanargmax(scores)])

        def loss(change: np.ndarray) -> float:
            lag_, rate_ = lag + change[0] * step, rate + (change[1] * _APART_S / length if free_rate else 0.0)
            return -_score(video, imu(_stamps(time_s, lag_, rate_)))[0]

        simplex = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]) if free_rate else np.array([[-1.0], [1.0]])
        best = minimize(
            loss,
            simplex[0],
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-9},
        )
        change = best.x[1] if free_rate else 0.0
        return -best.fun, lag + best.x[0] * step, rate + change * _APART_S / length

    score, lag, rate = fit(1.0, lags, scores, free_rate=False)
    tops = [np.nanmax(scores_) if np.isfinite(scores_).any() else -1.0 for _, scores_ in coarse]
    top = int(np.argmax(tops))
    freed = fit(float(rates[top]), *coarse[top], free_rate=True)
    if freed[0] > score + _RATE_GAIN:
        (score, lag, rate), (lags, scores) = freed, coarse[top]
    heading = _score(video, imu(_stamps(time_s, lag, rate)))[1]
    return Alignment(lag, rate, float(time_s[0]), heading, score, runner_up(lags, scores, lag))


def check_overlap(time_s: np.ndarray, imu: Signal, search_s: float) -> None:
    """InputError when the IMU was not recorded within the video's times (T,) at any lag within +-search_s."""
    held = imu.time_s[is_finite(imu.values)]
    if not len(held) or min(time_s[-1], held[-1]) - max(time_s[0], held[0]) + search_s < LEAST_S:
        raise InputError("files-apart", _no_overlap(time_s, imu, search_s))


def heading_deg(video: np.ndarray, imu: np.ndarray) -> float:
    """The turn about the vertical that brings an IMU's accelerations (T, 3) nearest to a video's."""
    return _score(video, imu)[1]


def agreement(
    video: np.ndarray, imu: np.ndarray, step_s: float, norms: bool = False
) -> dict[str, dict[str, float]]:
    """By "x", "y", "z" and "norm": r, RMSE, gain and remaining lag of accelerations (N, 3) in the same axes, step_s
    apart, NaN where missing. norms: that both third columns hold norms (motion.as_vertical); then of these alone.

    Means over the compared rows are taken out first, as any over a take is an error of tilt or bias; `offset_mps2` is
    the IMU's less the video's. gain: the video's amplitude over the IMU's (ratio of standard deviations). lag_s:
    where that axis alone would correlate best, less the take's lag; NaN when its best is at the search's edge.
    """
    both = is_finite(video) & is_finite(imu)
    a, b = _centred(video, both), _centred(imu, both)
    offset = imu[both].mean(axis=0) - video[both].mean(axis=0)
    columns = {"norm": 2} if norms else {"x": 0, "y": 1, "z": 2}
    result = {
        name: {**_agreement(a[:, i], b[:, i], step_s), "offset_mps2": float(offset[i])}
        for name, i in columns.items()
    }
    of_norms = _agreement(np.linalg.norm(a, axis=-1), np.linalg.norm(b, axis=-1), step_s)
    return result if norms else {**result, "norm": of_norms}


def _agreement(a: np.ndarray, b: np.ndarray, step_s: float) -> dict[str, float]:
    both = np.isfinite(a) & np.isfinite(b)
    return {
        "r": correlation(a[both], b[both], _STILL_MPS2),
        "rmse_mps2": float(np.sqrt(np.mean((a[both] - b[both]) ** 2))),
        "gain": float(a[both].std() / max(b[both].std(), 1e-12)),
        "lag_s": _own_lag(a, b, step_s),
    }


def _stamps(time_s: np.ndarray, lag_s: float, rate: float) -> np.ndarray:
    return time_s[0] + lag_s + (time_s - time_s[0]) * rate


def _score(video: np.ndarray, imu: np.ndarray) -> tuple[float, float]:
    """Correlation over three axes at the best heading, and that heading in degrees; -1 and NaN without overlap."""
    both = is_finite(video) & is_finite(imu)
    if both.sum() < 3:
        return -1.0, float("nan")
    a, b = video[both] - video[both].mean(axis=0), imu[both] - imu[both].mean(axis=0)
    turn = np.vdot(b[:, 0] + 1j * b[:, 1], a[:, 0] + 1j * a[:, 1])
    energy = np.sqrt((a**2).sum() * (b**2).sum())
    score = (abs(turn) + (a[:, 2] * b[:, 2]).sum()) / max(float(energy), 1e-12)
    return float(score), float(np.degrees(np.angle(turn)))


def _scores(
    time_s: np.ndarray, video: np.ndarray, imu: Signal, search_s: float, rate: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lags (L,) within the search and their scores (L,), NaN where too little is known to both, of an IMU whose clock
    has that rate."""
    from scipy.signal import correlate

    step = float(time_s[1] - time_s[0])
    reach = max(1, int(search_s / step))
    lags = np.arange(-reach, reach + 1) * step * rate
    stamps = time_s[0] + np.arange(-reach, len(time_s) + reach) * step * rate
    (a, a_up, a_known), (b, b_up, b_known) = _parts(video), _parts(imu(stamps))

    def at_lags(of_video: np.ndarray, of_imu: np.ndarray) -> np.ndarray:
        return correlate(of_imu, of_video, mode="valid", method="fft")

    common = at_lags(a_known, b_known)
    enough = common > max(LEAST_S / step, LEAST_SHARE * common.max()) - 0.5
    energies = at_lags(_energy(a, a_up), b_known), at_lags(a_known, _energy(b, b_up))
    energy = np.sqrt(np.maximum(energies[0], 1e-12) * np.maximum(energies[1], 1e-12))
    return lags, np.where(enough, (np.abs(at_lags(a, b)) + at_lags(a_up, b_up)) / energy, np.nan)


def _parts(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Horizontal (T,) as complex numbers, vertical (T,), both less their means and 0 where unknown, and where known."""
    known = is_finite(values)
    x = np.where(known[:, None], values - (values[known].mean(axis=0) if known.any() else 0.0), 0.0)
    return x[:, 0] + 1j * x[:, 1], x[:, 2], known.astype(float)


def _energy(horizontal: np.ndarray, vertical: np.ndarray) -> np.ndarray:
    return np.abs(horizontal) ** 2 + vertical**2


def _centred(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """values (T, 3) less their mean over rows (T,), NaN in the rest."""
    return np.where(rows[:, None], values - values[rows].mean(axis=0), np.nan)


def _own_lag(a: np.ndarray, b: np.ndarray, step_s: float) -> float:
    """Seconds by which b (T,) is late against a (T,), to a fraction of a step by a parabola through the peak."""
    reach = round(_AXIS_S / step_s)
    r = np.full(2 * reach + 1, -1.0)
    for i, shift in enumerate(range(-reach, reach + 1)):
        first = a[max(0, -shift) : len(a) - max(0, shift)]
        second = b[max(0, shift) : len(b) + min(0, shift)]
        both = np.isfinite(first) & np.isfinite(second)
        if both.sum() > 2:
            r[i] = correlation(first[both], second[both], _STILL_MPS2)
    top = int(np.nanargmax(r))
    if top in (0, 2 * reach):
        return float("nan")
    before, at, after = r[top - 1 : top + 2]
    bend = before - 2 * at + after
    return float((top - reach + (0.5 * (before - after) / bend if bend < 0 else 0.0)) * step_s)


def _no_overlap(time_s: np.ndarray, imu: Signal, search_s: float) -> str:
    held = imu.time_s[is_finite(imu.values)]
    said = f"from {held[0]:.6g} to {held[-1]:.6g} s" if len(held) else "nowhere"
    seen = f"from {time_s[0]:.6g} to {time_s[-1]:.6g} s" if len(time_s) else "nowhere"
    return (
        f"Expected at least {LEAST_S:g} s of motion in both video and IMU; the video's is {seen}, the IMU's {said}, "
        f"and lags up to {search_s:g} s were tried: give what must be added to the IMU's time with --offset S, or a "
        "wider --search S."
    )
