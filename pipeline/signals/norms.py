"""Whether the distance, speed or acceleration of a joint can be told beside its error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..core.limits import limit

# Codes of `<joint>_distance_reason`, `<joint>_speed_reason` and `<joint>_acceleration_reason`: there is a value; the
# joint is missing, and too long for a value in between; the standard deviation is larger than all that the take has.
FINE, MISSING, UNCERTAIN = range(3)


def cannot_be_told(columns: Mapping[str, np.ndarray], name: str) -> bool:
    """Whether most values of a speed or an acceleration are too uncertain. columns: (T,) of a take's kinematics."""
    reason = columns.get(f"{name}_reason")
    if reason is None or (reason == MISSING).all():
        return False
    return bool((reason[reason != MISSING] == UNCERTAIN).mean() > limit("errors.uncertain"))
