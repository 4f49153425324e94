"""A told focal length against the walker's own steps, and a camera that zooms against feet that stand.

How far somebody goes towards the camera is as long as the focal length; how far the feet that stand go back under the
body is the body's own. Where both differ by more than lifted steps err, the focal length is not the camera's. And
where a foot stands while it and the body come nearer all the same, the image grows by itself.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.signals.filters import breaks, rate
from .events import Stance
from .foot_lock import flat_rows
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
# Of the distance from the camera, by which the body and a foot that stands come nearer in a second: 0.212 at most in
# 378 sound validation takes, whose lifts may show a walk in depth as standing; more than 0.25 in 62 of 126 of them
# that zoom by 1 % a frame, which is 0.3. And how many times as far as the body goes from that foot: a focal length
# that is told three times too long makes it go twice as far.
_ZOOMS, _SLIDES = 0.25, 2.0
_STOOD = 4, 0.8  # frames of a foot that stands, and seconds of all, that tell it


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


def zoom_by_feet(filtered: PoseSequence, rectified: Rectified, gait: Gait) -> float | None:
    """By what share the image grows in a second while the person stands; negative where it shrinks. None where an
    estimated pelvis path and feet that stand show no zoom, and where they do not tell. On a belt only the feet move."""
    if filtered.root is None or rectified.R_source_from_level.ndim != 2:
        return None
    view = rectified.source.basis.T[2] @ rectified.R_source_from_level
    away = filtered.root.astype(np.float64) @ view
    known, growths, frames = np.isfinite(away), list[float](), list[int]()
    for side, rows in flat_rows(gait.feet, known, filtered.times, breaks(filtered)):
        foot = (away + filtered.joint(f"{side}_ankle").astype(np.float64) @ view)[rows]
        both = np.stack([foot, away[rows]], axis=1)
        if len(foot) < _STOOD[0] or not (both > 0).all():  # NaN is not
            continue
        slopes = -np.polyfit(filtered.times[rows], np.log(both), 1)[0]
        slides = slopes.prod() > 0 and abs(slopes[0]) > _SLIDES * abs(slopes[1] - slopes[0])
        growths.append(float(np.sign(slopes[0]) * np.abs(slopes).min()) if slides else 0.0)
        frames.append(len(foot))
    if sum(frames) < _STOOD[1] * rate(filtered.times):
        return None
    growth = float(np.median(np.repeat(growths, frames)))
    return growth if abs(growth) > _ZOOMS else None


def _walked(gait: Gait) -> Mapping[str, list[Stance]]:
    """Stances that begin in a walk."""
    spans = [(walk[0].start_s, walk[-1].stop_s) for walk in gait.walks]
    return {
        side: [stance for stance in feet if any(a <= stance.start_s <= b for a, b in spans)]
        for side, feet in gait.feet.items()
    }
