"""Frame rates of runs that are compared: how far a lifted person is seen to move depends on them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.take import Take

# Of the higher rate to the lower one, and from which rate on all are lifted alike. Ranges of the built-in walker's knee
# from five sides: 24 and 30 a second are 0 to 2 degrees apart (1 on average), 60 and 120 by 0.2 at most.
_APART, _ALIKE_HZ = 1.5, 60.0


def is_lifted(run: Take) -> bool:
    """Whether a run lifted its poses itself."""
    return run.poses is not None and run.poses.made_by.in_run


def rates_apart(takes: str, rates: Iterable[float]) -> tuple[Notice, ...]:
    """What is to be said of lifted takes with so many frames a second; nothing where they have about one rate, or fewer
    than two are known. takes: "runs", as the sentence calls them."""
    known = sorted(rate for rate in rates if np.isfinite(rate))
    if not known or min(known[-1], _ALIKE_HZ) <= _APART * known[0]:
        return ()
    return (notice("rates-differ", takes=takes, least_fps=known[0], most_fps=known[-1]),)
