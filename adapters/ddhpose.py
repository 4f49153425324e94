"""Exports of DDHPose, and of D3DP and MixSTE, which save alike: clips of 243 frames (formats.md 2).

    (frames, 17, 3)                          put together by the exporting script
    (clips, 243, 17, 3)                      clips as the network gave them
    (clips, steps, proposals, 243, 17, 3)    the same with every sampling step and every proposal
    (steps, proposals, frames, 17, 3)        D3DP's test_3d_<video>_output.npy

The last sampling step is taken, and the mean over the proposals (P-Agg), which is the one aggregation that needs no
ground truth. The last clip overlaps the one before it or was filled up, and neither shows in the array: the number of
frames has to be given with every array of clips. A (frames, 17, 3) file has to be named: it looks like VideoPose3D's
and like MotionBERT's with `rootrel`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.messages import how_many
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import plain_array
from .kit.lifters import CLIP, CLIPS, FRAMES, check_metric, fits, in_camera

name = "ddhpose"
gives = "poses"
made_by = MadeBy("estimated", "DDHPose")
reads = "DDHPose, D3DP and MixSTE exports (.npy), also as clips of 243 with steps and proposals, metres"


_CLIPS, _ALL_CLIPS, _ALL_FRAMES = CLIPS
_CLAMP_M = 1.1  # the diffusion's range on each axis


def sniff(path: Path) -> bool:
    return name in fits(path)


def read(path: Path, frames: int | None = None) -> tuple[PoseSequence]:
    """The one person of the file: H36M17 in camera axes, metres.

    frames: number of frames of the video. Needed for clips; for the other shapes it is only compared.
    Coordinates at the clamp of 1.1 m, which may lie further out in truth, are counted in the history.
    Raises InputError for another shape, for a number of frames that the clips cannot hold, for other units
    than metres, and for arrays of which numpy's squeeze has left more than one reading.
    """
    stored = plain_array(path, *CLIPS, FRAMES)
    if (
        stored.ndim == len(_ALL_FRAMES)
        and stored.shape[2] == CLIP
        and 1 not in stored.shape
        and frames != CLIP
    ):
        raise InputError(
            "needs-input",
            f"{path}: shape {stored.shape} can be steps and proposals of one video of {CLIP} frames, or clips from "
            f"which squeeze removed an axis; pass frames={CLIP} (--option frames={CLIP}) "
            "for the former, else save without squeeze.",
        )
    proposals = _last_step(stored)
    if proposals.ndim == len(_CLIPS) + 1:
        proposals = _joined(path, proposals, frames)
    elif frames not in (None, proposals.shape[1]):
        raise InputError(
            "bad-value",
            f"{path}: expected {how_many(frames, 'frame')}, as option frames says, got {proposals.shape[1]}.",
        )
    poses = in_camera(proposals.mean(axis=0, dtype=np.float64), CLIP)
    check_metric(path, poses.joints)
    clamped = int(np.isclose(np.abs(proposals), _CLAMP_M, rtol=0, atol=1e-6).sum())
    return (poses.noted("clamped", values=clamped, limit_m=_CLAMP_M) if clamped else poses,)


def _last_step(stored: np.ndarray) -> np.ndarray:
    """(proposals, frames, 17, 3) or, of clips, (proposals, clips, 243, 17, 3)."""
    if stored.ndim == len(_ALL_FRAMES):
        return stored[-1]
    if stored.ndim == len(_ALL_CLIPS):
        return np.swapaxes(stored[:, -1], 0, 1)
    return stored[np.newaxis]


def _joined(path: Path, clips: np.ndarray, frames: int | None) -> np.ndarray:
    """(proposals, frames, 17, 3) from (proposals, clips, 243, 17, 3), without overlap and without filling."""
    count = clips.shape[1]
    if frames is None:
        raise InputError(
            "needs-input",
            f"{path} holds {how_many(count, 'clip')} of {CLIP} frames, the last of which overlaps the one before it or "
            "was filled up; pass frames=N (--option frames=N) with the number of frames of the video.",
        )
    last = frames - (count - 1) * CLIP
    if not 0 < last <= CLIP:
        raise InputError(
            "bad-value",
            f"{path} holds {how_many(count, 'clip')} of {CLIP} frames, which make {(count - 1) * CLIP + 1} to "
            f"{count * CLIP} frames, got the option frames={frames}; give the number of frames of the video.",
        )
    tail = clips[:, -1, :last] if count == 1 else clips[:, -1, CLIP - last :]
    return np.concatenate([*np.moveaxis(clips[:, :-1], 1, 0), tail], axis=1)
