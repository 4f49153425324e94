"""A told focal length against the walker's own steps.

How far somebody goes towards the camera is as long as the focal length; how far the feet that stand go back under the
body is the body's own. Where both differ by more than lifted steps err, the focal length is not the camera's.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.signals.filters import breaks
from .events import Stance
from .gait import Gait
from .parameters import carried

# Of the logarithm of the pelvis's way over the feet's: its mean and spread over 33 walks of validation takes before
# typical cameras with the right focal length, for lifted legs swing too little in depth; and the share of a wrong
# focal length's logarithm that shows in it, for the lift errs with it.
_USUAL, _SPREAD, _SHOWN = 0.16, 0.14, 0.75
_BEYOND = 2.5  # standard deviations
_STEADY = 0.25  # error of a take's own ratio, at most
_DEPTH = 0.5  # of the feet's way, along the view at least
_BELT = 0.5  # of the feet's way: who comes nearer by less is on a belt, perhaps
_FEWEST = 3  # stances


def focal_by_steps(filtered: PoseSequence, rectified: Rectified, gait: Gait) -> float | None:
    """How many times the focal length of an estimated pelvis path is too long by the walker's steps; None where it fits
    them, and where they do not tell: in a run, across the view, on a belt, before a camera that moves."""
    if gait.kind != "walking" or filtered.root is None or rectified.R_source_from_level.ndim != 2:
        return None
    view = rectified.source.basis.T[2] @ rectified.R_source_from_level
    view = view[:2] / np.linalg.norm(view[:2])
    ankles = {side: filtered.joint(f"{side}_ankle")[:, :2].astype(np.float64) for side in gait.feet}
    drifts, backs = carried(filtered.root[:, :2], ankles, filtered.times, _walked(gait), breaks(filtered))
    if len(drifts) < _FEWEST:
        return None
    went, stepped = (drifts - backs) @ view, -backs @ view
    size = float(stepped @ stepped)
    ratio = float(went @ stepped) / size
    if size < _DEPTH**2 * float((backs**2).sum()) or not ratio > _BELT:
        return None
    off = went - ratio * stepped
    own = np.sqrt(float(off @ off) / (len(off) - 1) / size) / ratio
    apart = np.log(ratio) - _USUAL
    if own > _STEADY or abs(apart) < _BEYOND * np.hypot(_SPREAD, own):
        return None
    return float(np.exp(apart / _SHOWN))


def _walked(gait: Gait) -> Mapping[str, list[Stance]]:
    """Stances that begin in a walk."""
    spans = [(walk[0].start_s, walk[-1].stop_s) for walk in gait.walks]
    return {
        side: [stance for stance in feet if any(a <= stance.start_s <= b for a, b in spans)]
        for side, feet in gait.feet.items()
    }
