"""The gait of a take's motion, and how far the legs come apart in its noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.core.rotations import transpose
from ..common.motion import Motion
from .gait import LEAST_STEP, Gait, facing_deg, find_gait

SIDES = {"right": "r", "left": "l"}
_USUAL = 0.12  # lengths of a leg: the separation's deviation by the built-in lifter, median of lifted validation takes
NOISE = 2.0 * float(np.sqrt(2))  # standard deviations of a frame's value: twice that of a difference of two


def gait_of(motion: Motion) -> Gait:
    """Stances and walks, with steps beyond the noise that the columns state. Where the camera moves, turns of the
    person are not told from the camera's and end no walk."""
    rectified, facing = motion.rectified, None
    if not motion.moving_camera:
        facing = facing_deg(transpose(rectified.R_source_from_level) @ rectified.R_source_from_body)
    least = least_step(motion.columns, motion.unjudged)
    return find_gait(motion.body, motion.times, motion.seams, facing_deg=facing, least=least)


def least_step(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """By how much the ankles' separation changes from landing to landing at least, in lengths of a leg, by the stated
    standard deviations in the columns (T,). unjudged: as of separation_sd."""
    return max(LEAST_STEP, NOISE * separation_sd(columns, unjudged))


def separation_sd(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """Median standard deviation of the separation, in lengths of a leg, by those that the columns (T,) state for thighs
    and shanks in degrees. Both bones are half of a leg, and the four errors are taken for independent. Where none is
    stated it is 0, or, for a lifter whose errors were not measured (unjudged), that of the built-in lifter's angles."""
    usual = _USUAL if unjudged else 0.0
    parts = [
        0.5 * np.cos(np.radians(columns[f"{name}_deg"])) * np.radians(columns[f"{name}_sd_deg"])
        for name in (f"{side}_{bone}_sagittal" for side in "rl" for bone in ("thigh", "shank"))
        if f"{name}_deg" in columns and f"{name}_sd_deg" in columns
    ]
    if len(parts) < 4:
        return usual
    sd = np.sqrt(np.sum(np.square(parts), axis=0))
    known = sd[np.isfinite(sd)]
    return float(np.median(known)) if len(known) else usual
