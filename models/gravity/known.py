"""The up that a lift may rest on: known from elsewhere, and not contradicted by the skeletons."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ...pipeline.core.camera import Look
from ...pipeline.core.pose import PoseSequence
from ...pipeline.plugins.protocols import Rectifier
from ..common.spread import stated_spread
from .evidence import Evidence
from .fusion import KNOWN_DEG
from .levelling import static_up
from .moving import sliding_up, timed, with_looks
from .sampling import take_rotation
from .seen import Seen

_VOTES = 300  # frames are enough to see a contradiction


def known_up(
    poses: PoseSequence, rectifier: Rectifier, told: Sequence[Evidence] = (), look: Look | None = None
) -> np.ndarray | None:
    """(3,) unit, which way is up in a camera that stands still; None where it is known badly, or by the skeletons more
    than by anything else, as where an image is not believed. poses: a first lift, H36M17 in CAMERA, that knew nothing
    of up. told: what the user tells; look: what the image says. InputError as of fusion.decide."""
    if not told and look is None:
        return None
    rows = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), _VOTES)).astype(int))
    poses = poses.without_feet
    R, error_deg = rectifier.rotation(poses.joints[rows])
    seen = Seen(poses.joints[rows], R, error_deg, poses.times[rows], spread=stated_spread(poses)[rows])
    up = static_up(seen, told, look)
    return up.up if float(up.error_deg) < KNOWN_DEG and up.by_bodies < 0.5 else None


def known_moving_up(poses: PoseSequence, rectifier: Rectifier, looks: Sequence[Look]) -> np.ndarray | None:
    """(T, 3) unit, the smooth up of a camera that moves, or None as of known_up. poses: as there; looks: what its
    images say.

    Between two clip boundaries it is there throughout or nowhere (NaN), for a lift that is told up in some frames only
    jumps where that begins: it is there where images tell up well in most frames, and in the others it is what images
    further away and the skeletons say."""
    said = timed(looks, poses)
    if not said:
        return None
    poses = poses.without_feet
    R, error_deg = take_rotation(rectifier, poses.joints, poses.times, poses.seams)
    seen = Seen(poses.joints, R, error_deg, poses.times, poses.seams, spread=stated_spread(poses))
    bodies = sliding_up(seen)
    up = with_looks(bodies, seen, said)
    # What images leave of the skeletons' error: below this as by_bodies below 0.5.
    left, half = up.error_deg / np.nan_to_num(bodies.error_deg, nan=np.inf), np.sqrt(0.5)
    sure_up = np.full((len(poses), 3), np.nan)
    for start, end in pairwise([0, *poses.seams, len(poses)]):
        part = slice(start, end)
        looked_at = any(poses.times[start] <= at <= poses.times[end - 1] for at, _ in said)
        sure = np.median(np.asarray(up.error_deg)[part]) < KNOWN_DEG
        if looked_at and sure and np.median(left[part]) < half:
            sure_up[part] = up.up[part]
    return sure_up if np.isfinite(sure_up).any() else None
