"""What is done about swaps (swaps.py): told, put right, or masked.

Only certain ones are touched, and only where putting them right makes the take better: joints must not move more, bones
not change their length more, a walker's legs not alternate less.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any, Literal

import numpy as np

from .alternation import alternation
from .pose import PoseSequence
from .swaps import Swap, find_swaps, has_depth, kinds
from .take import Event

Swaps = Literal["report", "repair", "mask"]

_MOST_RANGES = 8  # told of one kind
_BONES = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


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
            "probability": round(swap.probability, 2),
            "change": round(swap.change, 2),
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
    """Each kind with its frames, such as "legs exchanged in frames 17-21, 53"; "" when there are none. Those that are
    not certain come after, with what is not."""
    ranges: dict[str, list[str]] = {}
    frames = [int(frame) for frame in poses.frame_index]
    for swap in sorted(swaps, key=lambda swap: (not swap.certain, swap.one_sided, swap.first_row)):
        first, last = frames[swap.first_row], frames[swap.last_row]
        span = f"{first}" if first == last else f"{first}-{last}"
        if swap.certain:
            ranges.setdefault(f"{swap.kind} in frames", []).append(span)
        elif swap.one_sided:
            ends = [frames[row] for row in (swap.first_row, swap.last_row + 1) if 0 < row < len(poses)]
            told = ranges.setdefault(f"{swap.kind} before or after each of the frames", [])
            told += [f"{end}" for end in ends if f"{end}" not in told]
        else:
            ranges.setdefault(f"perhaps {swap.kind} in frames", []).append(span)
    return "; ".join(
        f"{what} {', '.join(told[:_MOST_RANGES])}" + (", ..." if len(told) > _MOST_RANGES else "")
        for what, told in ranges.items()
    )


def settled(poses: PoseSequence, swaps: Iterable[Swap]) -> tuple[tuple[Swap, ...], tuple[str, ...]]:
    """The swaps that are to be put right, and sentences about the others: uncertain ones, and those of a kind that
    would make the take worse."""
    swaps = tuple(swaps)
    doubtful = [swap for swap in swaps if not swap.certain]
    said = []
    if doubtful:
        either = any(swap.one_sided for swap in doubtful)
        which = "which part is wrong" if either else "whether they are"
        said.append(f"{told(poses, doubtful)}: {which} cannot be told, and nothing is changed there.")
    kept: tuple[Swap, ...] = ()
    for kind in dict.fromkeys(swap.kind for swap in swaps if swap.certain):
        group = tuple(swap for swap in swaps if swap.kind == kind and swap.certain)
        worse = worsened(poses, repair_swaps(poses, group), kind)
        if worse:
            said.append(f"{told(poses, group)}, it seems, but put right {' and '.join(worse)}; so it is left as it is.")
        else:
            kept += group
    return kept, tuple(f"{text[0].upper()}{text[1:]}" for text in said)


def worsened(before: PoseSequence, after: PoseSequence, kind: str) -> tuple[str, ...]:
    """What the repair of a kind of swaps made worse, as verbs with their objects; () if nothing."""
    measures = {
        "joints would move more": (_paths(before), _paths(after)),
        "bones would change their length more": (_stretch(before), _stretch(after)),
    }
    worse = [text for text, (old, new) in measures.items() if new > old]
    way = next(way for way in kinds(before.layout, has_depth(before)) if way.name == kind)
    if way.exchanged:
        old, new = (alternation(way.vectors(poses.joints), poses.times).sum() for poses in (before, after))
        if new < old:
            worse.append("they would alternate less in walking")
    return tuple(worse)


def _paths(poses: PoseSequence) -> float:
    """How far all joints move from row to row, together."""
    return float(np.nansum(np.linalg.norm(np.diff(poses.joints, axis=0), axis=-1)))


def _stretch(poses: PoseSequence) -> float:
    """How much all limb bones change their length from row to row, together."""
    bones = [
        poses.layout.indices((f"{side}_{a}", f"{side}_{b}"))
        for side in "lr"
        for a, b in _BONES
        if f"{side}_{a}" in poses.layout and f"{side}_{b}" in poses.layout
    ]
    first, second = np.array(bones).T
    lengths = np.linalg.norm(poses.joints[:, first] - poses.joints[:, second], axis=-1)
    return float(np.nansum(np.abs(np.diff(lengths, axis=0))))


def treated(
    poses: PoseSequence | None, keypoints: PoseSequence | None, how: Swaps
) -> tuple[PoseSequence | None, PoseSequence | None, tuple[Event, ...]]:
    """Poses and keypoints of a take after their swaps were told, put right or masked, and what to say of it.

    A lift of exchanged keypoints is wrong in all its joints. So poses that came beside such keypoints cannot be put
    right: unless swaps are only told, they are missing in those frames.
    """
    events: list[Event] = []
    if keypoints is not None:
        keypoints, swaps, said = _treated(keypoints, "keypoints", how)
        events += said
        if poses is not None and swaps:
            frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
            poses, beside = _beside(poses, frames, how)
            events.append(beside)
    if poses is not None:
        poses, _, said = _treated(poses, "poses", how)
        events += said
    return poses, keypoints, tuple(events)


def _treated(
    poses: PoseSequence, what: str, how: Swaps
) -> tuple[PoseSequence, tuple[Swap, ...], list[Event]]:
    """Poses after treatment, the swaps that were treated or should be, and what to say."""
    found = find_swaps(poses)
    swaps, doubts = settled(poses, found)
    events = [Event("warning", f"Of the {what}: {doubt}") for doubt in doubts]
    if swaps:
        events.insert(0, _event(poses, swaps, what, how))
    if how == "report":
        return poses.noted("swaps", found=as_frames(poses, found)) if found else poses, swaps, events
    if not swaps:
        return poses, swaps, events
    return (repair_swaps if how == "repair" else mask_swaps)(poses, swaps), swaps, events


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
