"""How wrong a gait figure may be: standard deviations that were fitted on lifted walks with truth.

The error of a mean over N steps or strides is made of a part that all of them share, one that each has for itself, and
what the pelvis path's own error adds where lengths are read from that. gait_error.json was learned by
models/evaluation/gait_errors.py on validation subjects, so that nine in ten errors lie within 1.645 standard
deviations.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np

ERROR_FILE = Path(__file__).with_name("gait_error.json")
OF_LENGTH = ("walking_speed", "step_length", "stride_length", "step_width")


@cache
def shipped_errors() -> dict[str, dict[str, dict[str, float]]]:
    """What gait_error.json holds: {"walking", "running": {figure: {"shared", "each", "root"}}}."""
    content: dict[str, dict[str, dict[str, float]]] = json.loads(ERROR_FILE.read_text(encoding="utf-8"))[
        "figures"
    ]
    return content


def mean_error(gait: str, figure: str, count: int, root_sd: float = 0.0) -> float:
    """Standard deviation of the mean of `count` values of a figure (gait.time_values, gait.length_values), in its unit,
    lengths and speeds in lengths of a leg. gait: "walking" or "running". root_sd: of the pelvis path in lengths of a
    leg."""
    own = shipped_errors()[gait][figure]
    parts = (own["shared"], own["each"] / np.sqrt(count), own["root"] * root_sd / np.sqrt(count))
    return float(np.sqrt(np.sum(np.square(parts))))


def each_error(gait: str, figure: str) -> float:
    """Standard deviation of a single value that the next one does not share: what a spread has to exceed."""
    return shipped_errors()[gait][figure]["each"]
