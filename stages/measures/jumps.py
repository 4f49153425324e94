"""Jumps: how long the person flies and how high, where the pelvis path says how the centre of mass falls."""

from __future__ import annotations

from typing import Any

from ...models.gait.gait import Gait
from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.pose import Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.flights import NEEDED, flights
from .figures import figure_of_error, moments, rounded
from .walking import FEWEST

# What holds for nine in ten of 88 captured flights of train and validation subjects, against the feet's true contacts,
# by 1.645: frames at either end, and how far the ankle is stretched.
_TIME_SD_S = 0.026
_HEIGHT_SD = 0.013  # statures


def jumps(rectified: Rectified, gait: Gait) -> dict[str, Any]:
    """The group `jumps`: how many, when the feet leave the floor, flight times, and jump heights, by which the centre
    of mass rises after that (pipeline/signals/flights.py). Flights of a run are none."""
    level = rectified.level
    if level.root is None:
        return {"reason": "where the person is in the room is not known, or the camera moves"}
    if level.measured_root is None:
        return {"reason": "the pelvis path rests on the keypoints, and is too uncertain for flights"}
    if not rectified.level_ok:
        return {"reason": f"the take is not levelled: {rectified.level_reason}"}
    seen = is_finite(level.joints[:, level.layout.indices(NEEDED)]).all(axis=1) & is_finite(level.root)
    if seen.sum() < FEWEST:
        return {"reason": f"fewer than {FEWEST} frames have the trunk, both arms and both legs"}
    found = [
        flight
        for flight in flights(level)
        if not any(step.start_s < flight.land_s and flight.off_s < step.stop_s for step in gait.steps)
    ]
    if not found:
        return {"count": 0}
    stature = float(implied_stature(level.joints))
    error = _HEIGHT_SD * stature
    return {
        "count": len(found),
        "start_s": moments(flight.off_s for flight in found),
        "flight_time_s": [rounded(flight.land_s - flight.off_s, _TIME_SD_S) for flight in found],
        "flight_time_error_s": [figure_of_error(_TIME_SD_S)] * len(found),
        "jump_height": [rounded(flight.rise * stature, error) for flight in found],
        "jump_height_error": [figure_of_error(error)] * len(found),
    }
