"""What a report shows of a second lifter: how far it is from the poses over time, and by angle and joint."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ...pipeline.core.take import Take
from ..drawing.charts import SOFT, Curve, over_time
from ..drawing.page import Cell, charts, details, figure, small, table
from ..drawing.words import spoken
from ..second_lift import WARNED


def second_lift(take: Take) -> Markup:
    """HTML of how two lifts of the same keypoints differ; empty where there is one only."""
    found, apart = take.second_lift, (take.kinematics or {}).get("lifters_apart_percent")
    if found is None or apart is None or not found["frames"]:
        return Markup("")
    times = take.need("poses").times
    curves = [
        Curve("distance", apart),
        Curve("warned of", np.full(len(apart), WARNED), SOFT, dashed=True),
    ]
    title = "Mean distance of the joints (% of the person's size)"
    angles: list[list[Cell]] = [
        [spoken(name), of["mean_deg"], of["rms_deg"], of["p95_deg"], of["rms_deg"] / 2]
        for name, of in found["angles"].items()
    ]
    joints: list[list[Cell]] = [
        [spoken(name), of["apart_percent"].p50, of["apart_percent"].p95]
        for name, of in found["joints"].items()
    ]
    head = (
        "angle",
        "mean difference (°)",
        "root mean square (°)",
        "95 % of frames below (°)",
        "one errs by at least (°)",
    )
    return (
        small(
            f"The same keypoints lifted by {found['lifter']} too, brought to the same size. Where the two are apart, "
            "at least one of them errs by half of that or more. Where they agree, nothing is proved: both rest on the "
            "same keypoints and may err alike."
        )
        + charts([figure([over_time(curves, times, f"{title} over time")], title)])
        + table(head, angles)
        + details("Each joint", table(("joint", "distance, median (%)", "95 % of frames below (%)"), joints))
    )
