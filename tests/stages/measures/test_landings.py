"""A knee bend that takes up a landing is no squat; one before a jump, or long after it, is."""

import numpy as np
import pytest

from pcnet3d.models.gait.gait import Gait
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.signals.flights import Flight
from pcnet3d.stages.measures.stage import _Columns, _knee_bends

TIMES = np.arange(0, 6, 1 / 30)


@pytest.mark.parametrize(
    ("lowest_s", "count"), [((2.3,), 0), ((1.2,), 1), ((3.2,), 1), ((1.2, 2.3, 4.0), 2)], ids=str
)
def test_landing_is_no_squat(lowest_s, count):
    jump = Flight(off_s=1.6, apex_s=1.85, land_s=2.1, fall=5.8, rise=0.18, off_feet=2, land_feet=2)
    knee = sum(90 * np.exp(-(((TIMES - low_s) / 0.25) ** 2)) for low_s in lowest_s)
    columns = {f"{side}_knee_flexion_deg": knee for side in "rl"}
    still = np.zeros(len(TIMES))
    bends = nested(
        _knee_bends(_Columns(columns, TIMES, (), judged=True), Gait({"r": [], "l": []}, []), [jump], still)
    )
    assert (bends["count"], bends.get("squats", 0)) == (count, count)
