"""Jumps: how long the person flies and how high, where the pelvis path says how the centre of mass falls."""

from __future__ import annotations

from dataclasses import replace

from ...models.gait.gait import Gait
from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.measures import Measure, Remark, Row
from ...pipeline.core.pose import Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.flights import NEEDED, flights
from .figures import moments, with_error
from .walking import FEWEST

# What holds for nine in ten of 88 captured flights of train and validation subjects, against the feet's true contacts,
# by 1.645: frames at either end, and how far the ankle is stretched.
_TIME_SD_S = 0.026
_HEIGHT_SD = 0.013  # statures


def jumps(rectified: Rectified, gait: Gait) -> list[Row]:
    """The group `jumps`: how many, when the feet leave the floor, flight times, and jump heights, by which the centre
    of mass rises after that (pipeline/signals/flights.py). Flights of a run are none."""
    level = rectified.level
    if level.root is None:
        return [Remark("reason", "where the person is in the room is not known, or the camera moves")]
    if level.measured_root is None:
        return [Remark("reason", "the pelvis path is an estimate, too uncertain for flights")]
    if not rectified.level_ok:
        return [Remark("reason", f"the take is not levelled: {rectified.level_reason}")]
    seen = is_finite(level.joints[:, level.layout.indices(NEEDED)]).all(axis=1) & is_finite(level.root)
    if seen.sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the trunk, both arms and both legs")]
    found = [
        flight
        for flight in flights(level)
        if not any(step.start_s < flight.land_s and flight.off_s < step.stop_s for step in gait.steps)
    ]
    if not found:
        return [Measure("count", 0)]
    stature = float(implied_stature(level.joints))
    error = _HEIGHT_SD * stature
    return [
        Measure("count", len(found)),
        moments("start", (flight.off_s for flight in found)),
        *(
            replace(with_error("flight_time", "s", flight.land_s - flight.off_s, _TIME_SD_S), number=i)
            for i, flight in enumerate(found)
        ),
        *(
            replace(with_error("jump_height", "length", flight.rise * stature, error), number=i)
            for i, flight in enumerate(found)
        ),
    ]
