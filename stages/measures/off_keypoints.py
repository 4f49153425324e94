"""How far the limbs are off the keypoints that they were lifted from, or that came beside them."""

from __future__ import annotations

import numpy as np

from ...models.common.motion import Motion, agrees, contradicted, lasting, steady
from ...models.common.residuals import LIMBS, Residuals, residuals_of
from ...pipeline.core.measures import Row, side_of, within
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.take import Take
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.swaps import kinds
from .figures import moments


def off_keypoints(motion: Motion) -> list[Row]:
    """The group `off_keypoints`: from when to when a limb contradicts its keypoints. Empty without keypoints beside
    poses in a camera's axes."""
    residuals = motion.residuals
    if residuals is None:
        return []
    rows: list[Row] = []
    against = contradicted(residuals, motion.times)
    for limb in LIMBS:
        if spans := _spans(against[limb], motion.times):
            ends = [moments("start", (a for a, _ in spans)), moments("stop", (b for _, b in spans))]
            rows += within(limb, ends, side_of(limb))
    return rows


def exchanged(take: Take, motion: Motion) -> list[Notice]:
    """Notices of when both legs, or both arms, contradict their keypoints and agree with each other's for longer than
    BRIDGED_S. Of 101 lifted validation takes (wild cameras) 13 have 16 of these, and in each the simulated detector has
    exchanged the limbs."""
    residuals, times = motion.residuals, motion.times
    if residuals is None:
        return []
    keypoints, most, notices = take.need("keypoints"), agrees(residuals), []
    for kind in kinds(keypoints.layout):

        def farthest(off_rays: Residuals, pick: np.ufunc, limb: str = kind.limb) -> np.ndarray:
            return pick(*(steady(off_rays.limb(f"{side}_{limb}")) for side in "rl"))

        off = farthest(residuals, np.minimum) > most
        if not lasting(off, times).any():
            continue
        joints, confidence = kind.applied(keypoints.joints), kind.applied(keypoints.confidence)
        other = residuals_of(take.with_(keypoints=keypoints.with_(joints=joints, confidence=confidence)))
        if other and (spans := _spans(lasting(off & (farthest(other, np.maximum) <= most), times), times)):
            notices.append(notice("swapped-to-keypoints", limbs=f"{kind.limb}s", when=spans_in_words(spans)))
    return notices


def _spans(rows: np.ndarray, time_s: np.ndarray) -> list[tuple[float, float]]:
    return [(float(time_s[a]), float(time_s[b - 1])) for a, b in stretches(rows)]
