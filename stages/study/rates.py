"""Frame rates of runs that are compared: how far a lifted person is seen to move depends on them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...pipeline.core.take import Take

# Of the higher rate to the lower one, and from which rate on all are lifted alike. Ranges of the built-in walker's knee
# from five sides: 24 and 30 a second are 0 to 2 degrees apart (1 on average), 60 and 120 by 0.2 at most.
_APART, _ALIKE_HZ = 1.5, 60.0


def is_lifted(run: Take) -> bool:
    """Whether a run lifted its poses itself."""
    return run.poses is not None and run.poses.made_by.in_run


def rates_apart(rates: Iterable[float]) -> str:
    """What is to be said of lifted takes with so many frames a second: "lifted at 30 to 60 frames a second, ..."; empty
    where they have about one rate, or fewer than two are known."""
    known = sorted(rate for rate in rates if np.isfinite(rate))
    if not known or min(known[-1], _ALIKE_HZ) <= _APART * known[0]:
        return ""
    return (
        f"lifted at {known[0]:.4g} to {known[-1]:.4g} frames a second, which alone changes ranges of motion (of the "
        "knee in walking by 3 degrees from 30 to 60): film what is to be compared at one rate."
    )
