"""Which way is up, as the recording shows it: the frames' votes as the camera's pitch and roll, and what the take
makes of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.take import Take
from ..drawing.facts import tilt
from ..drawing.palette import PURPLE, YELLOW, faint
from ..drawing.rerun_log import log_curves

if TYPE_CHECKING:
    import rerun as rr

# For pitch and roll.
_TAKE = (PURPLE, YELLOW)
_VOTES, _BOUND = ([faint(colour, share) for colour in _TAKE] for share in (0.65, 0.5))


def log_up(recording: rr.RecordingStream, take: Take) -> None:
    """tilt: pitch and roll of the camera by the votes and by the take, with the 90 % bound. Some frames must have
    voted."""
    poses, both = take.need("poses"), ("pitch", "roll")
    votes, shared, bound = tilt(take)
    edges = (("low", shared - bound), ("high", shared + bound)) if np.isfinite(bound).any() else ()
    for edge, values in edges:
        names = [f"{angle}, {edge} end of its 90 % bound (deg)" for angle in both]
        log_curves(recording, f"tilt/{edge}", poses, values, names, _BOUND, width=1.0)
    names = [f"{angle}, votes (deg)" for angle in both]
    log_curves(recording, "tilt/votes", poses, votes, names, _VOTES, width=1.0)
    names = [f"{angle} of the camera (deg)" for angle in both]
    log_curves(recording, "tilt/take", poses, shared, names, _TAKE, width=2.0)
