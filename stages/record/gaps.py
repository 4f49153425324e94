"""Gaps that show as gaps: a viewer keeps showing the last thing it was told until it is told another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.take import Take


def gaps_marked(take: Take) -> Take:
    """The take's poses, keypoints and rectification with one row of NaN behind the last row before every gap, and
    behind the last row of all where the video or another of its tracks goes on. Its rows are no longer those that the
    take's events speak of."""
    poses = take.need("poses")
    keypoints, rectified, last = take.keypoints, take.need("rectified"), _last(take)
    behind = _before_gaps(poses, last) + 1
    levels = rectified.R_source_from_level
    return take.with_(
        keypoints=keypoints and _marked(keypoints, _before_gaps(keypoints, last) + 1),
        poses=_marked(poses, behind),
        kinematics=None,
        rectified=replace(
            rectified,
            level=_marked(rectified.level, behind),
            R_source_from_body=np.insert(rectified.R_source_from_body, behind, np.nan, axis=0),
            R_source_from_level=levels if levels.ndim == 2 else np.insert(levels, behind, np.nan, axis=0),
            error_deg=np.insert(rectified.error_deg, behind, np.nan),
            up_error_deg=np.insert(rectified.up_error_deg, behind, np.nan),
            up_bound_deg=np.insert(rectified.up_bound_deg, behind, np.nan),
            up_votes=np.insert(rectified.up_votes, behind, np.nan, axis=0),
        ),
    )


def angles_with_gaps_marked(take: Take) -> Take:
    """The same of the take's poses and angles alone: a long take's copies are not to be held all at once."""
    poses = take.need("poses")
    behind = _before_gaps(poses, _last(take)) + 1
    return take.with_(
        poses=_marked(poses, behind),
        kinematics={
            name: np.insert(values, behind, np.nan) if len(behind) else values
            for name, values in (take.kinematics or {}).items()
            if name.endswith("_deg")
        },
    )


def _last(take: Take) -> int:
    """The last frame that anything shows."""
    tracks = [track.frame_index[-1] for track in (take.poses, take.keypoints) if track is not None]
    return max(*tracks, take.video.span[1] if take.video else 0)


def _before_gaps(poses: PoseSequence, last: int) -> np.ndarray:
    """Rows that are not followed by another at the usual step, which is of two frames where poses are of every second;
    last: as `_last` says."""
    usual = np.median(np.diff(poses.frame_index)) if len(poses) > 1 else 1
    return np.flatnonzero(np.diff(poses.frame_index, append=last + 1) > usual)


def _marked(poses: PoseSequence, behind: np.ndarray) -> PoseSequence:
    if not len(behind):  # a long take need not be copied
        return poses
    frame = np.insert(poses.frame_index, behind, poses.frame_index[behind - 1] + 1)
    time_s = np.interp(frame, poses.frame_index, poses.times)
    if frame[-1] > poses.frame_index[-1]:
        time_s[-1] += 1 / poses.fps if len(poses) > 1 else 1e-3
    return poses.on_frames(frame, time_s)
