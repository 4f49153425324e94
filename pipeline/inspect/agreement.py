"""Whether 3D poses in camera axes fall onto 2D keypoints of the same recording, and at which shift in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.layouts import LIMBS
from ..core.pose import PoseSequence
from ..reading.clock import numbered_by
from ..signals.reprojection import off_in_image

_MOST_LAG = 30  # frames
_FEWEST = 10  # frames in common below which a shift says nothing


@dataclass(frozen=True)
class Agreement:
    """How well poses fall onto keypoints.

    error: median over frames of how far hips to wrists are off in the image plane (`off_in_image`). 0.05 is usual:
        scale and shift are no perspective.
    lag: frames to add to the poses' numbers for the smallest error, which is `error_at_lag`.
    person: the keypoints' track. frames: in common without a lag.
    """

    person: str
    frames: int
    error: float
    lag: int
    error_at_lag: float


def agreement(poses: PoseSequence, tracks: tuple[PoseSequence, ...]) -> Agreement | None:
    """The track that fits best; None when there is none with enough frames and joints in common.

    poses: H36M17 in CAMERA axes. Where they have no frame numbers, they take those of a track of equal length, and
    otherwise count from 0.
    """
    found = [fit for track in tracks if (fit := _agreement(poses, track))]
    return min(found, key=lambda fit: fit.error_at_lag, default=None)


def _agreement(poses: PoseSequence, track: PoseSequence) -> Agreement | None:
    if not poses.frames_known and len(poses) == len(track):
        poses = numbered_by(track, poses, "")
    names = [name for name in LIMBS if name in track.layout]
    flat = poses.joints[:, poses.layout.indices(names), :2].astype(np.float64)
    points = track.joints[:, track.layout.indices(names)].astype(np.float64)
    errors, frames = {}, 0
    for lag in range(-_MOST_LAG, _MOST_LAG + 1):
        _, rows, columns = np.intersect1d(poses.frame_index + lag, track.frame_index, return_indices=True)
        off = off_in_image(flat[rows], points[columns])
        known = int(np.isfinite(off).sum())
        if lag == 0:
            frames = known
        if known >= _FEWEST:
            errors[lag] = float(np.nanmedian(off))
    if 0 not in errors:
        return None
    best = min(errors, key=lambda lag: (errors[lag], abs(lag)))
    return Agreement(track.person, frames, errors[0], best, errors[best])
