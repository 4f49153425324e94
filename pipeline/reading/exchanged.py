"""Exchanged limbs, or both on one, in a take's poses and keypoints: told or masked, as the user asks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Swaps
from ..signals.swaps import Swap, as_frames, find_swaps, mask_swaps, notices_of, ways_of, wrong_rows


def treated(
    poses: PoseSequence | None, keypoints: PoseSequence | None, how: Swaps
) -> tuple[PoseSequence | None, PoseSequence | None, tuple[Notice, ...], tuple[Swap, ...] | None]:
    """Poses and keypoints of a take after their swaps were told or masked, what to say of it, and what find_swaps finds
    in the poses that are returned: None where they were changed, and it has to be asked again.

    A lift of exchanged keypoints is wrong in all its joints. So poses that came beside such keypoints are missing in
    those frames, unless swaps are only told.
    """
    notices: list[Notice] = []
    of_poses = None
    if keypoints is not None:
        keypoints, swaps, notices = _treated(keypoints, "keypoints", how)
        frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
        if poses is not None and len(frames):
            wrong = np.isin(poses.frame_index, frames)
            count, where = int(wrong.sum()), "where those of the keypoints are exchanged"
            if how == "report":
                notices.append(notice("swapped-keypoints", wrong=count))
            else:
                joints = np.where(wrong[:, None, None], np.nan, poses.joints)
                poses = poses.with_(joints=joints).noted("swaps", rows_masked=count)
                notices.append(notice("swaps-masked", what="poses", swaps=where, wrong=count, of=len(poses)))
    if poses is not None:
        poses, of_poses, more = _treated(poses, "poses", how)
        notices += more
        if how != "report" and any(swap.certain for swap in of_poses):
            of_poses = None
    return poses, keypoints, tuple(notices), of_poses


def _treated(
    poses: PoseSequence, what: str, how: Swaps
) -> tuple[PoseSequence, tuple[Swap, ...], list[Notice]]:
    """Poses after treatment, the swaps that were found, and what to say, with the frames of those that are left."""
    swaps, ways = find_swaps(poses), ways_of(poses.layout)
    exchanged = [
        (ways[swap.kind].limb, *poses.frame_index[[swap.first_row, swap.last_row]].tolist())
        for swap in swaps
        if how == "report" or not swap.certain
    ]
    notices = [
        replace(each, values={**each.values, "exchanged": exchanged})
        for each in notices_of(poses, swaps, what, how)
    ]
    if how == "report":
        return poses.noted("swaps", found=as_frames(poses, swaps)) if swaps else poses, swaps, notices
    return mask_swaps(poses, swaps) if any(swap.certain for swap in swaps) else poses, swaps, notices
