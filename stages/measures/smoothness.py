"""How smooth a movement is, from its speed: SPARC and the log dimensionless jerk; and how long a path is.

Both are of one movement, from rest to rest, and have no unit: neither its size nor its speed changes them. Sources:
Balasubramanian, Melendez-Calderon & Burdet, "A robust and sensitive metric for quantifying movement smoothness", IEEE
Trans Biomed Eng 59(8), 2012; Balasubramanian, Melendez-Calderon, Roby-Brami & Burdet, "On the analysis of movement
smoothness", J NeuroEng Rehabil 12:112, 2015. The latter finds SPARC to be the one that noise changes less.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.filters import derivative, runs

# Of the 2015 paper: the arc ends at this frequency, or at the last one with this share of the largest.
_HIGHEST_HZ, _QUIET = 10.0, 0.05
_PADDED = 4  # doublings of the length before the transform, so that the spectrum's arc is a smooth line
_SHORTEST = 6  # rows


def sparc(speed: np.ndarray, fps: float) -> float:
    """Spectral arc length of a movement's speed (T,), evenly spaced and without gaps: about -1.4 for one minimum-jerk
    stroke, lower the less smooth. NaN for fewer than 6 rows or no movement."""
    if len(speed) < _SHORTEST or not np.isfinite(speed).all() or not np.any(speed):
        return float("nan")
    length = 2 ** (int(np.ceil(np.log2(len(speed)))) + _PADDED)
    hz = np.fft.rfftfreq(length, 1 / fps)
    size = np.abs(np.fft.rfft(speed, length))
    size = (size / size.max())[hz <= _HIGHEST_HZ]
    last = int(np.flatnonzero(size >= _QUIET)[-1])
    return -float(np.hypot(1 / max(last, 1), np.diff(size[: last + 1])).sum())


def log_dimensionless_jerk(speed: np.ndarray, fps: float) -> float:
    """-ln(duration^3 / peak^2 x the integral of the squared second derivative of the speed), speed (T,) as for `sparc`:
    -5.32 for one minimum-jerk stroke, -4.42 for its part above 5 % of its highest speed, lower the less smooth. Of
    filtered video it is mostly about the filter and the noise: compare it between takes of one filter only."""
    if len(speed) < _SHORTEST or not np.isfinite(speed).all() or not np.any(speed):
        return float("nan")
    time_s = np.arange(len(speed)) / fps
    bent = derivative(speed, time_s, order=2)
    integral = np.trapezoid(bent**2, time_s)
    return -float(np.log(time_s[-1] ** 3 / np.abs(speed).max() ** 2 * integral))


def path_length(points: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> tuple[float, float]:
    """How far points (T, D) go inside their unbroken pieces, in their unit, and how many seconds those pieces last."""
    length = duration = 0.0
    for piece in runs(np.asarray(is_finite(points)), time_s, seams):
        length += float(np.linalg.norm(np.diff(points[piece], axis=0), axis=-1).sum())
        duration += float(time_s[piece][-1] - time_s[piece][0])
    return length, duration
