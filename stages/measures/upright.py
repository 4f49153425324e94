"""Whether a person is upright: movements of one who lies, crawls or stands on the hands are no squats."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import unit
from .cycles import Repetition

# Degrees that the trunk leans by at most where a movement begins and ends, and at its highest: labelled people who lift
# a box lean by up to 77 in between.
_UPRIGHT, _BOWED = 60.0, 120.0
NOT_UPRIGHT = "what is seen from {} is not counted: the person is not upright"


def leans(level: PoseSequence) -> np.ndarray:
    """(T,) degrees of the trunk from upright, of joints in LEVEL."""
    trunk = unit(level.joint("thorax").astype(np.float64) - level.joint("pelvis"))
    return np.degrees(np.arccos(np.clip(trunk[:, 2], -1, 1)))


def is_upright(lean: np.ndarray, times: np.ndarray, one: Repetition) -> bool:
    """Whether somebody is where a repetition begins, is highest and ends, by lean (T,) in degrees (`leans`) at times
    (T,) in seconds; true too where that is not known."""
    begins, highest, ends = lean[np.searchsorted(times, [one.start_s, one.peak_s, one.stop_s])]
    return not (begins > _UPRIGHT or ends > _UPRIGHT or highest > _BOWED)
