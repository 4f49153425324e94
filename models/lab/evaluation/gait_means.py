"""A take's means of gait figures and their differences of right and left, found and true, with their stated errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.metrics import SD_90, Figure
from ...gait.contact import SIDES
from ...gait.errors import FEWEST_OF_A_SIDE, OF_LENGTH, OF_SIDES, scatter, shipped_errors, style_of
from ...gait.gait import Values

FIGURES = (
    "step_time_s", "stride_time_s", "stance_time_s", "swing_time_s", "stance_percent", "swing_percent",
    "single_support_percent", "double_support_percent", "flight_time_s", *OF_LENGTH,
)  # fmt: skip


@dataclass(frozen=True)
class Mean:
    """A take's mean of one figure, found and true, of `count` values that were found; lengths in metres. scatter:
    standard deviation of these values. gait: what was found, "walking" or "running". leg: length of a leg in metres.
    style: gait.errors.style_of what was found. root_sd, share: stated of the pelvis path, in metres, and of all strides
    alike (gait.errors.path_error)."""

    found: float
    true: float
    count: int
    scatter: float
    gait: str
    leg: float
    style: dict[str, float]
    root_sd: float = 0.0
    share: float = 0.0

    @property
    def size(self) -> float:
        """What an error is a share of."""
        return self.true

    def sd(self, name: str) -> float:
        """The stated standard deviation, in the figure's unit."""
        own = shipped_errors().mean(
            self.gait, name, self.count, self.root_sd / self.leg, self.style, self.scatter
        )
        return float(np.hypot(self.leg * own, self.share * self.found)) if name in OF_LENGTH else own


@dataclass(frozen=True)
class Difference:
    """A take's mean of one figure over the right side's steps less that over the left's, found and true; lengths in
    metres. size: mean of both sides in truth, so that an error's share of it is that of the symmetry index. counts:
    values that were found of right and left. gait, leg: as Mean's. depth: gait.errors.depth_of_steps."""

    found: float
    true: float
    size: float
    counts: tuple[int, int]
    gait: str
    leg: float
    depth: float

    def sd(self, name: str) -> float:
        """The stated standard deviation, in the figure's unit."""
        own = shipped_errors().difference(self.gait, name, *self.counts, self.depth)
        return self.leg * own if name in OF_LENGTH else own


def _both(values: Values, name: str) -> np.ndarray:
    return np.concatenate([values[name][side] for side in SIDES])


def means_of(found: Values, true: Values, gait: str, leg: float, *path_errors: float) -> dict[str, Mean]:
    """{figure: Mean} of those of FIGURES that were found and are true. path_errors: Mean.root_sd and share."""
    result = {}
    style = style_of(found)
    for name in FIGURES:
        a, b = (values[np.isfinite(values)] for values in (_both(found, name), _both(true, name)))
        if len(a) and len(b):
            result[name] = Mean(
                float(a.mean()), float(b.mean()), len(a), scatter(a), gait, leg, style, *path_errors
            )
    return result


def differences_of(found: Values, true: Values, gait: str, leg: float, depth: float) -> dict[str, Difference]:
    """{figure: Difference} of those that both sides have enough values of, found and true."""
    result = {}
    for name in OF_SIDES:
        sides = [values[name][side] for values in (found, true) for side in SIDES]
        sides = [values[np.isfinite(values)] for values in sides]
        if min(map(len, sides)) >= FEWEST_OF_A_SIDE:
            right, left, true_right, true_left = (float(values.mean()) for values in sides)
            size, counts = (true_right + true_left) / 2, (len(sides[0]), len(sides[1]))
            result[name] = Difference(right - left, true_right - true_left, size, counts, gait, leg, depth)
    return result


def figure_of(name: str, means: Sequence[Mean | Difference]) -> dict[str, Any]:
    """Of many takes: how many, the median truth and error, the size of errors and the share within the stated ones."""
    size = np.array([mean.size for mean in means])
    error = np.array([mean.found - mean.true for mean in means])
    true = np.array([mean.true for mean in means])
    inside = np.array([abs(mean.found - mean.true) <= SD_90 * mean.sd(name) for mean in means])
    return {
        "takes": len(means),
        "true": float(np.median(true)),
        "bias": float(np.median(error)),
        "error": Figure.of(np.abs(error)),
        "error_percent": Figure.of(100 * np.abs(error / size)),
        "inside": float(inside.mean()),
    }
