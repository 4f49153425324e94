"""A take's columns, as the measures read them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...models.angle_error.repeatability import Between, difference_sd, range_sd
from ...pipeline.core.measures import SD_90, Curve
from ...pipeline.signals.angles import EXCHANGED, UNDEFINED, UNTRUSTED, of_both, unwrapped
from ...pipeline.signals.foot_angles import ALL_ANGLES
from .cycles import alike, normalised
from .figures import FEWEST_FOR_SD


@dataclass(frozen=True)
class Columns:
    """The take's columns (T,) and its clock; an angle is NaN throughout where it is not among them. judged: whether the
    errors of its differences are known (repeatability.judged). unstated_deg: standard deviation of angles that state
    none."""

    columns: dict[str, np.ndarray]
    times: np.ndarray
    seams: tuple[int, ...]
    judged: bool
    unstated_deg: float = 0.0

    def difference_sd(self, figure: str, errors: tuple[float, float], between: Between) -> float:
        """Of two figures, whose errors are independent where nothing is known of their difference."""
        return difference_sd(figure, errors, between) if self.judged else float(np.hypot(*errors))

    def range_sd(self, angle: str, found_deg: float, ends: tuple[float, float]) -> float:
        """Of a range of an angle, or of how far it rises, by the standard deviations of both ends."""
        error = float(np.hypot(*ends))
        return range_sd(of_both(angle), found_deg, error, float(np.ptp(self.times))) if self.judged else error

    def rise_error(self, angle: str, rise_deg: float, sd_deg: float) -> float:
        """Half the width of the 90 % bar of a rise. sd_deg: the angle's usual one, NaN where none is stated."""
        sd_deg = sd_deg if np.isfinite(sd_deg) else self.unstated_deg
        return SD_90 * self.range_sd(angle, rise_deg, (sd_deg, sd_deg))

    @property
    def unknown(self) -> float:
        """The standard deviation of an angle that states none, for errors: 0 of motion capture, NaN of a lifter."""
        return float("nan") if self.unstated_deg else 0.0

    def __call__(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_deg", np.full(len(self.times), np.nan))

    def sd(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_sd_deg", np.full(len(self.times), np.nan))

    def untold(self, angle: str) -> dict[int, float]:
        """{code: share of the take's frames} in which the joints were seen, and the angle cannot be told all the same:
        near the axis that it turns about, by an error that is too large, or by limbs that may be exchanged."""
        reason, codes = self.columns.get(f"{angle}_reason"), (UNDEFINED, UNTRUSTED, EXCHANGED)
        return {} if reason is None else {code: float((reason == code).mean()) for code in codes}

    def cycles(self, angle: str, spans: np.ndarray) -> Curve | None:
        """Mean and, of six or more, standard deviation of an angle over spans (N, 2) in seconds; None when none is
        whole."""
        curves = alike(
            normalised(unwrapped(self(angle)), self.times, spans, self.seams), ALL_ANGLES[angle].centre_deg
        )
        if not len(curves):
            return None
        sd = tuple(curves.std(axis=0, ddof=1).tolist()) if len(curves) >= FEWEST_FOR_SD else None
        return Curve(angle, len(curves), tuple(curves.mean(axis=0).tolist()), sd)
