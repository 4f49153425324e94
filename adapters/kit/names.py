"""Joints by the names that programs and people give them: "left_knee", "LKnee", "knee_r", "RBigToe", "mid_hip"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache

from .clock import plain

# Without _ between their words.
_PAIRED = {
    **{part: part for part in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist", "heel", "eye", "ear")},
    **dict.fromkeys(("bigtoe", "hallux", "bigtoetip"), "big_toe"),
    **dict.fromkeys(("smalltoe", "littletoe", "smalltoetip"), "small_toe"),
    "footindex": "foot_index",
}
_PELVIS = ("pelvis", "hip", "hips", "chip", "midhip", "midhips", "hipcenter", "centerhip", "root")
_MIDDLE = {
    **{part: part for part in ("nose", "neck", "head", "spine", "thorax")},
    **dict.fromkeys(_PELVIS, "pelvis"),
    **dict.fromkeys(("headtop", "tophead", "topofhead", "vertex"), "head_top"),
}
_SIDES = {"left": "l", "l": "l", "lt": "l", "right": "r", "r": "r", "rt": "r"}
_FUSED = re.compile(rf"(left|right|l|r)({'|'.join(sorted(_PAIRED, key=len, reverse=True))})")
_MPII = re.compile(
    r"(hip|knee|ankle|shoulder|elbow|wrist)([12])"
)  # DeepLabCut's full_human: right before left


@lru_cache(1 << 12)
def joint_named(label: str) -> str:
    """Our name of a joint; "" for a point that is none of ours."""
    parts = plain(label).split("_")
    if match := _MPII.fullmatch("".join(parts)):
        return f"{'rl'[int(match[2]) - 1]}_{match[1]}"
    if match := _FUSED.fullmatch("".join(parts)):
        return f"{_SIDES[match[1]]}_{_PAIRED[match[2]]}"
    for at in (0, -1):
        rest = "".join(parts[1:] if at == 0 else parts[:-1])
        if parts[at] in _SIDES and rest in _PAIRED:
            return f"{_SIDES[parts[at]]}_{_PAIRED[rest]}"
    return _MIDDLE.get("".join(parts), "")


def joints_named(labels: Sequence[str]) -> dict[str, int]:
    """Where each joint is among labels; the first of those of one name."""
    places: dict[str, int] = {}
    for i, label in enumerate(labels):
        if joint := joint_named(label):
            places.setdefault(joint, i)
    return places
