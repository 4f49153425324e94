"""Gaps that show as gaps: a viewer keeps showing the last thing it was told until it is told another."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.take import Take


def last_frame(take: Take) -> int:
    """The last that anything of the take shows."""
    tracks = [track.frame_index[-1] for track in (take.poses, take.keypoints) if track is not None]
    return max(*tracks, take.video.span[1] if take.video else 0)


def gap_rows(poses: PoseSequence, last: int) -> np.ndarray:
    """(N,) rows before which `np.insert` puts one of NaN: behind each that another does not follow at the usual step,
    which is of two frames where poses are of every second, and behind the last where frames go on to `last`."""
    usual = np.median(np.diff(poses.frame_index)) if len(poses) > 1 else 1
    return np.flatnonzero(np.diff(poses.frame_index, append=last + 1) > usual) + 1


def gaps_marked(poses: PoseSequence, rows: np.ndarray) -> PoseSequence:
    """The poses with a row of NaN before each of `rows` (N,), as of `gap_rows`."""
    if not len(rows):  # a long take need not be copied
        return poses
    frame = np.insert(poses.frame_index, rows, poses.frame_index[rows - 1] + 1)
    time_s = np.interp(frame, poses.frame_index, poses.times)
    if frame[-1] > poses.frame_index[-1]:
        time_s[-1] += 1 / poses.fps if len(poses) > 1 else 1e-3
    return poses.on_frames(frame, time_s)
