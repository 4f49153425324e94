"""The report's section on a walk or a run: how fast and how far, times of the gait cycle, sides, and curves over it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from ..drawing.page import heading, small
from .measures import cycle_charts, measure_tables

_CYCLE = (
    "Means over strides, from a foot's initial contact (0 %) to its next (100 %). Upright line: its mean toe-off, "
    "where stance ends and swing begins."
)
_SIDES = {"r_": "right", "l_": "left"}


def gait_section(walking: Mapping[str, Any], length: str) -> Markup:
    """HTML of the measures `walking` (stages/measures/stage.py) of a take that has steps. length: the unit of lengths,
    "m" or "au"."""
    figures = {key: value for key, value in walking.items() if key not in ("gait", "cycles")}
    cycles = walking.get("cycles", {})
    toe_off = {
        prefix: walking[side]["mean_stance_percent"]
        for prefix, side in _SIDES.items()
        if "mean_stance_percent" in walking.get(side, {})
    }
    charts = cycle_charts(cycles, "gait cycle (%)", toe_off)
    return measure_tables(figures, length, level=3) + (
        heading("Gait cycle") + small(_CYCLE) + charts if charts else Markup("")
    )
