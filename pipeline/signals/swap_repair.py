"""What is done about swaps (swaps.py): told, put right, or masked.

Only certain ones are touched, and only where putting them right makes the take better: joints must not move more, bones
not change their length more, a walker's legs not alternate less.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from ..core.layouts import FEET
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Swaps, Take
from .alternation import alternation
from .swaps import Kind, Swap, assumed_times, find_swaps, has_depth, kinds

_CODES = {"report": "swaps-found", "repair": "swaps-repaired", "mask": "swaps-masked"}
_MOST_RANGES = 8  # told of one kind
_STRETCH = 1.1  # of 280 right repairs on CMU and ACCAD val subjects 3 are beyond, of 130 wrong ones 3 of 4
_BONES = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


def repair_swaps(poses: PoseSequence, swaps: Iterable[Swap]) -> PoseSequence:
    """A copy in which the swaps that find_swaps found in these poses are put right; the history lists them."""
    ways = _ways(poses)
    joints, confidence = poses.joints.copy(), poses.confidence.copy()
    swaps = tuple(swaps)
    for swap in swaps:
        way, rows = ways[swap.kind], slice(swap.first_row, swap.last_row + 1)
        joints[rows], confidence[rows] = way.applied(joints[rows]), way.applied(confidence[rows])
    return poses.with_(joints=joints, confidence=confidence, feet=_feet(poses, swaps, exchanged=True)).noted(
        "swaps", repaired=as_frames(poses, swaps)
    )


def mask_swaps(poses: PoseSequence, swaps: Iterable[Swap]) -> PoseSequence:
    """A copy in which the joints that are exchanged or mirrored are missing; the history lists them."""
    ways = _ways(poses)
    joints = poses.joints.copy()
    swaps = tuple(swaps)
    for swap in swaps:
        pairs = ways[swap.kind].pairs
        joints[swap.first_row : swap.last_row + 1, pairs if ways[swap.kind].exchanged else pairs[:, 0]] = (
            np.nan
        )
    feet = _feet(poses, swaps, exchanged=False)
    return poses.with_(joints=joints, feet=feet).noted("swaps", masked=as_frames(poses, swaps))


def _ways(poses: PoseSequence) -> dict[str, Kind]:
    """The ways to be wrong by their names."""
    return {way.name: way for way in kinds(poses.layout, has_depth(poses))}


def _feet(poses: PoseSequence, swaps: Iterable[Swap], exchanged: bool) -> np.ndarray | None:
    """The feet (T, 6, D) with those of exchanged legs exchanged too, if asked for, and missing where a leg is masked or
    mirrored in depth."""
    if poses.feet is None:
        return None
    feet, ways = poses.feet.copy(), _ways(poses)
    for swap in swaps:
        way, rows = ways[swap.kind], slice(swap.first_row, swap.last_row + 1)
        if way.exchanged and way.limb == "leg" and exchanged:
            feet[rows] = feet[rows][:, FEET.mirror]
        elif way.limb != "arm":
            feet[rows] = np.nan
    return feet


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
    """Each kind with its frames, such as "legs exchanged in frames 17-21 from 0.57 s, 53 at 1.77 s"; "" without. Those
    that are not certain come after, with what is not."""
    beside = ", or in those beside them (which is unclear)"
    ranges: dict[tuple[str, str], list[str]] = {}
    frames = [int(frame) for frame in poses.frame_index]
    for swap in sorted(swaps, key=lambda swap: (not swap.certain, swap.one_sided, swap.first_row)):
        first, last = frames[swap.first_row], frames[swap.last_row]
        span = f"{first}" if first == last else f"{first}-{last}"
        if poses.time_s is not None:
            span += f" {'at' if first == last else 'from'} {poses.time_s[swap.first_row]:.2f} s"
        what = f"{'' if swap.certain or swap.one_sided else 'perhaps '}{swap.kind} in frames"
        ranges.setdefault((what, beside if swap.one_sided else ""), []).append(span)
    said = []
    for (what, or_where), told in ranges.items():
        one = len(told) == 1 and "-" not in told[0]
        more = ", ..." if len(told) > _MOST_RANGES else ""
        said.append(
            f"{what.removesuffix('s') if one else what} {', '.join(told[:_MOST_RANGES])}{more}{or_where}"
        )
    return "; ".join(said)


def settled(poses: PoseSequence, swaps: Iterable[Swap]) -> tuple[tuple[Swap, ...], tuple[str, ...]]:
    """The swaps to repair, and notices about the others (see `told`): uncertain ones, and all of a kind whose repair
    would make the take worse."""
    swaps = tuple(swaps)
    doubtful = [swap for swap in swaps if not swap.certain]
    said = [f"{told(poses, doubtful)}; this is too uncertain to be changed"] if doubtful else []
    kept: tuple[Swap, ...] = ()
    for kind in dict.fromkeys(swap.kind for swap in swaps if swap.certain):
        group = tuple(swap for swap in swaps if swap.kind == kind and swap.certain)
        after = repair_swaps(poses, group)
        if worse := worsened(poses, after):
            said.append(
                f"{told(poses, group)}, but after a repair {' and '.join(worse)}, so nothing is changed there"
            )
        else:
            kept, poses = kept + group, after
    return kept, tuple(said)


def worsened(before: PoseSequence, after: PoseSequence) -> tuple[str, ...]:
    """What a repair made worse, as clauses; () if nothing. before, after: the same take, joints changed places or depth
    in some rows. At the ends of these rows joints and the lengths of bones leap less after a repair that is right."""
    worse = []
    old, new = _at_ends(before.joints, after.joints)
    if new > old:
        worse.append("joints would leap farther")
    old, new = _at_ends(_lengths(before)[..., None], _lengths(after)[..., None])
    if new > _STRETCH * old:
        worse.append("bones would change their lengths more")
    legs = kinds(before.layout, False)[0]
    old = alternation(legs.vectors(before.joints), assumed_times(before)).sum()
    new = alternation(legs.vectors(after.joints), assumed_times(after), agreed=0).sum()
    if new < old / 2:
        worse.append("the legs would not alternate as they do in a walk")
    return tuple(worse)


def _at_ends(before: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    """Of values (T, N, D) from row to row, the change where it is not the same in both, summed."""
    old, new = (np.nan_to_num(np.linalg.norm(np.diff(x, axis=0), axis=-1)) for x in (before, after))
    steps = ~np.isclose(old.sum(axis=1), new.sum(axis=1), rtol=1e-6, atol=0)
    return float(old[steps].sum()), float(new[steps].sum())


def _lengths(poses: PoseSequence) -> np.ndarray:
    """(T, B) of limb bones."""
    ends = [(f"{side}_{a}", f"{side}_{b}") for side in "lr" for a, b in _BONES]
    bones = [poses.layout.indices(bone) for bone in ends if all(joint in poses.layout for joint in bone)]
    bones = np.array(bones, dtype=int).reshape(-1, 2)
    return np.linalg.norm(poses.joints[:, bones[:, 0]] - poses.joints[:, bones[:, 1]], axis=-1)


def treated(
    poses: PoseSequence | None, keypoints: PoseSequence | None, how: Swaps
) -> tuple[PoseSequence | None, PoseSequence | None, tuple[Notice, ...], tuple[Swap, ...] | None]:
    """Poses and keypoints of a take after their swaps were told, put right or masked, what to say of it, and what
    find_swaps finds in the poses that are returned: None where they were changed, and it has to be asked again.

    A lift of exchanged keypoints is wrong in all its joints. So poses that came beside such keypoints cannot be put
    right: unless swaps are only told, they are missing in those frames.
    """
    notices: list[Notice] = []
    found = None
    if keypoints is not None:
        keypoints, swaps, _, said = _treated(keypoints, "keypoints", how)
        notices += said
        if poses is not None and swaps:
            frames = keypoints.frame_index[wrong_rows(keypoints, swaps)]
            poses, beside = _beside(poses, frames, how)
            notices.append(beside)
    if poses is not None:
        poses, swaps, found, said = _treated(poses, "poses", how)
        notices += said
        found = None if swaps and how != "report" else found
    return poses, keypoints, tuple(notices), found


def _treated(
    poses: PoseSequence, what: str, how: Swaps
) -> tuple[PoseSequence, tuple[Swap, ...], tuple[Swap, ...], list[Notice]]:
    """Poses after treatment, the swaps that were treated or should be, all that were found, and what to say."""
    found = find_swaps(poses)
    swaps, doubts = settled(poses, found)
    left = [swap for swap in found if how == "report" or swap not in swaps]
    ways = _ways(poses) if left else {}
    exchanged = [
        (ways[swap.kind].limb, *poses.frame_index[[swap.first_row, swap.last_row]].tolist())
        for swap in left
        if ways[swap.kind].exchanged
    ]
    values: dict[str, Any] = {"what": what, "exchanged": exchanged}
    notices = [notice("swaps-doubtful", doubt=doubt, **values) for doubt in doubts]
    if swaps:
        wrong = int(wrong_rows(poses, swaps).sum())
        values |= {"swaps": told(poses, swaps), "wrong": wrong, "of": len(poses)}
        notices.insert(0, notice(_CODES[how], **values))
    if how == "report":
        poses = poses.noted("swaps", found=as_frames(poses, found)) if found else poses
    elif swaps:
        poses = (repair_swaps if how == "repair" else mask_swaps)(poses, swaps)
    return poses, swaps, found, notices


def in_doubt(take: Take) -> dict[str, np.ndarray]:
    """{"leg" or "arm": (T,) bool} in which rows of the poses these limbs may be exchanged: what `treated` has left of
    theirs, and of the keypoints if this run has lifted them."""
    poses = take.need("poses")
    doubt: dict[str, np.ndarray] = {}
    of = ("poses", "keypoints") if poses.made_by.in_run else ("poses",)
    for limb, first, last in left_exchanged(take.said, of):
        rows = (first <= poses.frame_index) & (poses.frame_index <= last)
        doubt[limb] = doubt.get(limb, False) | rows
    return doubt


def left_exchanged(
    said: Iterable[Notice], of: Collection[str] = ("poses", "keypoints")
) -> list[tuple[str, int, int]]:
    """("leg" or "arm", the first frame, the last) of limbs that may be exchanged, and were left so."""
    told = (each.values for each in said if each.code in ("swaps-found", "swaps-doubtful"))
    return [span for values in told if values.get("what") in of for span in values.get("exchanged", ())]


def _beside(poses: PoseSequence, frames: np.ndarray, how: Swaps) -> tuple[PoseSequence, Notice]:
    """Poses whose keypoints are exchanged in these frames."""
    wrong = np.isin(poses.frame_index, frames)
    if how == "report":
        return poses, notice("swapped-keypoints", wrong=int(wrong.sum()))
    masked = poses.mapped(lambda points: np.where(wrong[:, None, None], np.nan, points))
    count = int(wrong.sum())
    return masked.noted("swaps", rows_masked=count), notice("masked-with-keypoints", wrong=count)
