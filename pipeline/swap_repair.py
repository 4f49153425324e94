"""What is done about swaps (swaps.py): told, put right, or masked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, Literal

import numpy as np

from .pose import PoseSequence
from .swaps import Swap, find_swaps, has_depth, kinds
from .take import Event

Swaps = Literal["report", "repair", "mask"]

_MOST_RANGES = 8  # told of one kind


def repair_swaps(poses: PoseSequence, swaps: Iterable[Swap]) -> PoseSequence:
    """A copy in which the swaps that find_swaps found in these poses are put right; the history lists them."""
    ways = {way.name: way for way in kinds(poses.layout, has_depth(poses))}
    joints, confidence = poses.joints.copy(), poses.confidence.copy()
    swaps = tuple(swaps)
    for swap in swaps:
        way, rows = ways[swap.kind], slice(swap.first_row, swap.last_row + 1)
        joints[rows], confidence[rows] = way.applied(joints[rows]), way.applied(confidence[rows])
    return poses.with_(joints=joints, confidence=confidence).noted("swaps", repaired=as_frames(poses, swaps))


def mask_swaps(poses: PoseSequence, swaps: Iterable[Swap]) -> PoseSequence:
    """A copy in which the joints that are exchanged or mirrored are missing; the history lists them."""
    ways = {way.name: way for way in kinds(poses.layout, has_depth(poses))}
    joints = poses.joints.copy()
    swaps = tuple(swaps)
    for swap in swaps:
        pairs = ways[swap.kind].pairs
        joints[swap.first_row : swap.last_row + 1, pairs if ways[swap.kind].exchanged else pairs[:, 0]] = (
            np.nan
        )
    return poses.with_(joints=joints).noted("swaps", masked=as_frames(poses, swaps))


def as_frames(poses: PoseSequence, swaps: Iterable[Swap]) -> list[dict[str, Any]]:
    """Plain values, with the video's frame numbers beside the rows."""
    return [
        {
            **asdict(swap),
            "evidence": round(swap.evidence, 1),
            "first_frame": int(poses.frame_index[swap.first_row]),
            "last_frame": int(poses.frame_index[swap.last_row]),
        }
        for swap in swaps
    ]


def wrong_rows(poses: PoseSequence, swaps: Iterable[Swap]) -> np.ndarray:
    """(T,) True in rows of any of the swaps."""
    wrong = np.zeros(len(poses), dtype=bool)
    for swap in swaps:
        wrong[swap.first_row : swap.last_row + 1] = True
    return wrong


def told(poses: PoseSequence, swaps: Iterable[Swap]) -> str:
    """Each kind with its frames, such as "legs exchanged in frames 17-21, 53"; "" when there are none."""
    ranges: dict[str, list[str]] = {}
    for swap in sorted(swaps, key=lambda swap: swap.first_row):
        first, last = (int(poses.frame_index[row]) for row in (swap.first_row, swap.last_row))
        ranges.setdefault(swap.kind, []).append(f"{first}" if first == last else f"{first}-{last}")
    return "; ".join(
        f"{kind} in frames {', '.join(told[:_MOST_RANGES])}" + (", ..." if len(told) > _MOST_RANGES else "")
        for kind, told in ranges.items()
    )


def treated(
    poses: PoseSequence | None, keypoints: PoseSequence | None, how: Swaps
) -> tuple[PoseSequence | None, PoseSequence | None, tuple[Event, ...]]:
    """Poses and keypoints of a take after their swaps were told, put right or masked, and what to say of it.

    A lift of exchanged keypoints is wrong in all its joints. So poses that came beside such keypoints cannot be put
    right: unless swaps are only told, they are missing in those frames.
    """
    events: list[Event] = []
    if keypoints is not None and (swaps := find_swaps(keypoints)):
        events.append(_event(keypoints, swaps, "keypoints", how))
        if poses is not None:
            frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
            poses, said = _beside(poses, frames, how)
            events.append(said)
        keypoints = _treated(keypoints, swaps, how)
    if poses is not None and (swaps := find_swaps(poses)):
        events.append(_event(poses, swaps, "poses", how))
        poses = _treated(poses, swaps, how)
    return poses, keypoints, tuple(events)


def _treated(poses: PoseSequence, swaps: tuple[Swap, ...], how: Swaps) -> PoseSequence:
    if how == "report":
        return poses.noted("swaps", found=as_frames(poses, swaps))
    return repair_swaps(poses, swaps) if how == "repair" else mask_swaps(poses, swaps)


def _event(poses: PoseSequence, swaps: tuple[Swap, ...], what: str, how: Swaps) -> Event:
    found = f"{told(poses, swaps)} ({wrong_rows(poses, swaps).sum()} of {len(poses)} rows)"
    if how == "report":
        return Event(
            "warning", f"The {what} look wrong: {found}; --swaps repair or --swaps mask changes that."
        )
    return Event(
        "repair", f"The {what} were {'put right' if how == 'repair' else 'masked'} as asked: {found}."
    )


def _beside(poses: PoseSequence, frames: np.ndarray, how: Swaps) -> tuple[PoseSequence, Event]:
    """Poses whose keypoints are exchanged in these frames."""
    wrong = np.isin(poses.frame_index, frames)
    if how == "report":
        text = f"If the poses are a lift of these keypoints, {wrong.sum()} of them are wrong in all joints; without "
        return poses, Event(
            "warning", f"{text}--poses and with --swaps repair the keypoints are lifted again."
        )
    joints = np.where(wrong[:, None, None], np.nan, poses.joints)
    text = f"{wrong.sum()} poses were masked as asked, because the keypoints are exchanged there."
    return poses.with_(joints=joints).noted("swaps", rows_masked=int(wrong.sum())), Event("repair", text)
