"""Why steps would not be seen if there were any."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...models.gait.events import STEP_S
from ...models.gait.gait import LEAST_STEP
from ...models.gait.of_take import NOISE, SIDES, separation_sd, unjudged
from ...pipeline.core.frames import Frame
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.signals.filters import rate, stretches

_SIGHT_DEG = 30.0  # off the line of sight: nearer to it, cos 30 = 87 % of a step and more is depth
HIDES_S = 1.5  # three steps at 120 a minute, the shortest walk
_MOST = 0.9  # of the take, which is then named as a whole
_SLOW_HZ = 12.0  # a quick step of 0.4 s has fewer than five frames below this
# Lengths of a leg a second, about 0.4 m/s, as slow as stroke patients walk. Of 120 lifted takes without a walk one
# moves so fast in what may be two steps.
_WALKS = 0.45
# Of somebody who stands, in so long: of labelled takes that walk or run a knee bends by 35 and more in each step, and
# the feet are at heights that change by 0.1 leg lengths; lifted, too.
_STILL_DEG, _STILL_HEIGHT = 10.0, 0.05


def uncountable(
    apart: np.ndarray,
    columns: Mapping[str, np.ndarray],
    filtered: PoseSequence,
    rectified: Rectified,
    source: Frame,
) -> list[str]:
    """Why steps would not be seen if there were any; empty when they would, and of somebody who stands still. apart:
    (T,) the separation in lengths of a leg. columns: (T,) of the take's kinematics. source: the frame that the poses
    came in."""
    why = []
    still = _stands(columns, filtered)
    if not still and (spans := along_sight(rectified, source, filtered.times)):
        whole = spans[0][1] - spans[0][0] > _MOST * (filtered.times[-1] - filtered.times[0])
        when = "" if whole else f" from {spans_in_words(spans, 2)}"
        why.append(f"the person's face or back is towards the camera{when}; steps show best from the side")
    change = float(np.nanmax(apart) - np.nanmin(apart))
    error = NOISE * separation_sd(columns, unjudged(filtered, rectified))
    if not still and LEAST_STEP < change < error:
        why.append(
            f"the feet's distance changes by {change:.2g} leg lengths, no more than its error of {error:.2g}"
        )
    fps = rate(filtered.times)
    if fps < _SLOW_HZ:
        why.append(f"at {fps:.3g} frames per second a quick step of 0.4 s has {0.4 * fps:.2g} frames")
    return why


def passings(apart: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """When the ankles pass each other, by half of the least step at least to either side. apart, time_s: (T,)."""
    rows = np.flatnonzero(np.abs(apart) > LEAST_STEP / 2)
    turns = np.flatnonzero(np.diff(np.sign(apart[rows])))
    return (time_s[rows[turns]] + time_s[rows[turns + 1]]) / 2


def cut_walk(passed_s: np.ndarray, apart: np.ndarray, filtered: PoseSequence, leg: float) -> bool:
    """Whether two steps in a row, whole or cut, begin or end what is seen of the legs, over which the pelvis moves as
    in a walk: they may be part of one. passed_s: (N,) of `passings` of apart (T,); leg: its length."""
    if filtered.root is None or not len(passed_s):
        return False
    seen_s = filtered.times[np.flatnonzero(np.isfinite(apart))[[0, -1]]]
    moments = np.r_[seen_s[0], passed_s, seen_s[1]]
    steps = np.diff(moments) < STEP_S[1]
    for at_s, near in ((moments, steps), (moments[::-1], steps[::-1])):
        few = int(np.logical_and.accumulate(near).sum())
        since_s, until_s = sorted((at_s[0], at_s[few]))
        way = filtered.root[(filtered.times >= since_s) & (filtered.times <= until_s), :2]
        way = way[np.isfinite(way).all(axis=1)]
        if few > 1 and len(way) and np.linalg.norm(np.ptp(way, axis=0)) > _WALKS * leg * (until_s - since_s):
            return True
    return False


def along_sight(rectified: Rectified, source: Frame, times: np.ndarray) -> list[tuple[float, float]]:
    """From when to when, by times (T,) in seconds, the person faces along the camera's axis, or away from it, within
    _SIGHT_DEG in most frames of HIDES_S; stretches that are shorter hide no walk. None where the source is no
    camera."""
    if source.family != "camera":
        return []
    ahead = -rectified.R_source_from_body[:, :, 0]  # BODY's x is back
    with np.errstate(invalid="ignore"):
        near = np.abs(ahead @ source.basis[:, 2]) > np.cos(np.radians(_SIGHT_DEG))  # CAMERA's z is away
    first, last = (np.searchsorted(times, times + shift * HIDES_S / 2) for shift in (-1, 1))
    sums = np.r_[0, np.cumsum(near)]
    mostly = sums[last] - sums[first] > 0.5 * (last - first)
    spans = [(float(times[a]), float(times[b - 1])) for a, b in stretches(mostly)]
    return [(start, stop) for start, stop in spans if stop - start >= HIDES_S]


def _stands(columns: Mapping[str, np.ndarray], filtered: PoseSequence) -> bool:
    """Whether both legs are seen throughout and move less, from the side or from in front, than in any step."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d

    none = np.full(len(filtered), np.nan)
    knees = [columns.get(f"{side}_knee_flexion_deg", none) for side in SIDES.values()]
    hip, ankles = filtered.joint("r_hip"), [filtered.joint(f"{side}_ankle") for side in SIDES.values()]
    leg = float(np.nanmedian(np.linalg.norm(hip - ankles[0], axis=-1)))
    height = (ankles[0] - ankles[1])[:, 2] / leg
    frames = max(round(HIDES_S * rate(filtered.times)), 2)
    return all(
        bool(
            np.isfinite(x).all() and (maximum_filter1d(x, frames) - minimum_filter1d(x, frames)).max() < most
        )
        for x, most in ((knees[0], _STILL_DEG), (knees[1], _STILL_DEG), (height, _STILL_HEIGHT))
    )
