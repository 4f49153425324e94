"""Curves over a cycle of 0 to 100 %: of strides and of repetitions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models.common.motion import Motion
from ...pipeline.core.measures import Curve, side_of
from ...pipeline.signals.angles import ALL_ANGLES, near, unwrapped
from ...pipeline.signals.filters import resample
from .figures import FEWEST_FOR_SD

POINTS = 101  # of a normalised cycle


def mean_curve(motion: Motion, angle: str, spans: np.ndarray) -> list[Curve]:
    """Mean and, of six or more, standard deviation of an angle over spans (N, 2) in seconds; empty when none is
    whole."""
    curves = normalised(unwrapped(motion.angle(angle)), motion.times, spans, motion.seams)
    if not len(curves):
        return []
    begins = curves[
        :, :1
    ]  # of the first within half a turn of the angle's middle, of others of where that begins
    curves = curves + near(begins, near(begins[:1], ALL_ANGLES[angle].centre_deg)) - begins
    sd = tuple(curves.std(axis=0, ddof=1).tolist()) if len(curves) >= FEWEST_FOR_SD else None
    return [Curve(angle, len(curves), tuple(curves.mean(axis=0).tolist()), sd, side_of(angle))]


def normalised(x: np.ndarray, time_s: np.ndarray, spans: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 101) x (T,) over each of the spans (N, 2), from 0 to 100 % of its duration; spans in which any of x is
    missing are left out. An angle goes through `unwrapped` before."""
    at_s = np.linspace(spans[:, 0], spans[:, 1], POINTS, axis=-1)
    curves = resample(x, time_s, at_s.ravel(), seams).reshape(-1, POINTS)
    return curves[np.isfinite(curves).all(axis=1)]
