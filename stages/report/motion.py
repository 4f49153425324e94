"""What a report shows of speeds and accelerations: charts with their bands, or in words that one cannot be told."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ...models.common.metrics import SD_90
from ...pipeline.core.figures import label_of
from ...pipeline.core.take import Take
from ...pipeline.signals.norms import cannot_be_told
from ..drawing.charts import BAND, SIDES, over_time, sides
from ..drawing.facts import length_unit
from ..drawing.page import charts, figure, joined, small

_UNITS = {"speed": "{}/s", "acceleration": "{}/s²"}


def motion_charts(take: Take) -> Markup:
    """Speed and acceleration of wrists and ankles over time; empty where the take has no such columns."""
    columns, poses = take.kinematics or {}, take.need("poses")
    length = length_unit(poses)
    figures, untold, banded = [], [], False
    for limb in ("wrist", "ankle"):
        for quantity, unit in _UNITS.items():
            names = [f"{side}_{limb}_{quantity}" for side in "lr"]
            lost = [name for name in names if cannot_be_told(columns, name)]
            untold += lost
            nothing = np.full(len(poses), np.nan)
            values = [nothing if name in lost else columns.get(name, nothing) for name in names]
            if not np.isfinite(values).any():
                continue
            bands = [SD_90 * columns.get(f"{name}_sd", nothing) for name in names]
            banded |= bool(np.isfinite(bands).any())
            title = f"{limb.capitalize()} {quantity} ({unit.format(length)})"
            curves = sides(*values, left_margin=bands[0], right_margin=bands[1])
            figures.append(figure([over_time(curves, poses.times, f"{title} over time")], title))
    names = [name.rpartition("_") for name in untold]
    words = ", ".join(f"the {quantity} of the {label_of(joint)}" for joint, _, quantity in names)
    about = f"Relative to the pelvis, from the smoothed paths. {SIDES}" if figures else ""
    about += f" {BAND}" * banded
    missing = f"Not shown, because the error is larger than the values: {words}." if words else ""
    return joined(small(said) for said in (about, missing) if said) + charts(figures)
