"""What a report shows of speeds and accelerations: charts with their bands, or in words that one cannot be told."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ...models.common.metrics import SD_90
from ...pipeline.core.take import Take
from ..drawing.charts import BAND, SIDES, over_time, sides
from ..drawing.facts import length_unit
from ..drawing.page import charts, figure, small
from ..drawing.words import spoken
from ..trajectories import cannot_be_told

_UNITS = {"speed": "{}/s", "acceleration": "{}/s²"}


def motion_charts(take: Take) -> Markup:
    """Speed and acceleration of wrists and ankles over time; empty where the take has no such columns."""
    columns, poses = take.kinematics or {}, take.need("poses")
    length = length_unit(poses)
    figures, untold = [], []
    for limb in ("wrist", "ankle"):
        for quantity, unit in _UNITS.items():
            names = [f"{side}_{limb}_{quantity}" for side in "lr"]
            lost = [name for name in names if cannot_be_told(columns, name)]
            untold += lost
            nothing = np.full(len(poses), np.nan)
            values = [nothing if name in lost else columns.get(name, nothing) for name in names]
            if not np.isfinite(values).any():
                continue
            bands = [SD_90 * columns[f"{name}_sd"] if f"{name}_sd" in columns else None for name in names]
            title = f"{limb.capitalize()} {quantity} ({unit.format(length)})"
            curves = sides(*values, left_margin=bands[0], right_margin=bands[1])
            figures.append(figure([over_time(curves, poses.times, f"{title} over time")], title))
    names = [name.rpartition("_") for name in untold]
    words = ", ".join(f"the {quantity} of the {spoken(joint)}" for joint, _, quantity in names)
    if not figures and not words:
        return Markup("")
    return (
        small(
            "Relative to the pelvis, from the smoothed paths. "
            f"{SIDES}{f' {BAND}' * any(name.endswith('_sd') for name in columns)}"
        )
        + (
            small(f"Not shown, because the error is larger than the values: {words}.")
            if words
            else Markup("")
        )
        + charts(figures)
    )
