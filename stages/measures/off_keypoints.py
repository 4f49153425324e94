"""How far the limbs are off the keypoints that they were lifted from, or that came beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...models.angle_error.off_keypoints import agrees, steady
from ...pipeline.core.measures import Measure, Remark, Row, side_of, within
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import BRIDGED_S, stretches
from ...pipeline.signals.reprojection import LIMBS, Residuals, limb_scores, residuals_of
from ...pipeline.signals.swaps import kinds
from ...pipeline.signals.visibility import SURE_SCORE
from .figures import moments

Spans = Sequence[tuple[float, float]]  # (begin, end) in seconds


def contradicted(residuals: Residuals | None, time_s: np.ndarray) -> dict[str, list[tuple[float, float]]]:
    """{limb: (begin, end) in seconds of when it contradicts its keypoints}, beyond what agrees with them for longer
    than BRIDGED_S. time_s: (T,)."""
    if residuals is None:
        return {}
    most = agrees(residuals)
    return {limb: _spans(steady(residuals.limb(limb)) > most, time_s) for limb in LIMBS}


def not_shown(take: Take, residuals: Residuals | None) -> dict[str, list[tuple[float, float]]]:
    """The same, and of r_elbow and l_elbow when the detector is unsure of it: the upper arm's elevation is then off by
    over 20 degrees in 35 % of the frames of a woman before four real cameras (Pose2Sim's demo of two people), in 7 %
    where it is unsure of the wrist alone."""
    times = take.need("poses").times
    against = contradicted(residuals, times)
    for limb, scores in limb_scores(take).items():
        if limb.endswith("arm"):
            elbow, _wrist = scores.T
            against[limb.replace("arm", "elbow")] = _spans(elbow < SURE_SCORE, times)
    return against


def contradicts(at_s: float, against: Mapping[str, Spans], *limbs: str) -> bool:
    """Whether one of the limbs is `not_shown` (against) then."""
    return any(begin <= at_s <= end for limb in limbs for begin, end in against.get(limb, ()))


def off_keypoints(residuals: Residuals | None, time_s: np.ndarray) -> list[Row]:
    """The group `off_keypoints`: of each limb the median and the 95th percentile of its residual
    (signals/reprojection.py), in pixels and in per cent of the stature, and from when to when it is
    `contradicted`; why there is nothing else. time_s: (T,)."""
    if residuals is None:
        return [Remark("reason", "there are no keypoints beside poses in a camera's axes")]
    rows: list[Row] = []
    against = contradicted(residuals, time_s)
    for limb in LIMBS:
        share, px = residuals.limb(limb), residuals.limb_px(limb)
        known = np.isfinite(share)
        if not known.any():
            rows += within(limb, [Remark("reason", "its keypoints were not seen")], side_of(limb))
            continue
        own: list[Row] = [
            Measure(f"{name}_{what}", float(np.percentile(values[known], percentile)), unit)
            for what, unit, values in (("in_image", "px", px), ("of_stature", "percent", 100 * share))
            for name, percentile in (("median", 50), ("p95", 95))
        ]
        if spans := against[limb]:
            own += [moments("start", (a for a, _ in spans)), moments("stop", (b for _, b in spans))]
        rows += within(limb, own, side_of(limb))
    return rows


def exchanged(take: Take, residuals: Residuals | None) -> list[Notice]:
    """Notices of when both legs, or both arms, contradict their keypoints and agree with each other's for longer than
    BRIDGED_S. Of 101 lifted validation takes (wild cameras) 13 have 16 of these, and in each the simulated detector has
    exchanged the limbs. residuals: `residuals_of` the take."""
    if residuals is None:
        return []
    keypoints, times, most, said = take.need("keypoints"), take.need("poses").times, agrees(residuals), []
    for way in kinds(keypoints.layout, depth=False):

        def farthest(of: Residuals, pick: np.ufunc, limb: str = way.limb) -> np.ndarray:
            return pick(*(steady(of.limb(f"{side}_{limb}")) for side in "rl"))

        off = farthest(residuals, np.minimum) > most
        if not _spans(off, times):
            continue
        joints, confidence = way.applied(keypoints.joints), way.applied(keypoints.confidence)
        other = residuals_of(take.with_(keypoints=keypoints.with_(joints=joints, confidence=confidence)))
        if other and (spans := _spans(off & (farthest(other, np.maximum) <= most), times)):
            said.append(notice("swapped-to-keypoints", limbs=f"{way.limb}s", when=spans_in_words(spans)))
    return said


def _spans(off: np.ndarray, time_s: np.ndarray) -> list[tuple[float, float]]:
    pairs = ((float(time_s[a]), float(time_s[b - 1])) for a, b in stretches(off))
    return [(a, b) for a, b in pairs if b - a >= BRIDGED_S]
