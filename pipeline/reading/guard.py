"""The look at 3D poses before anything is made of them: whether left and right, and up and down, are right, and putting
the sides right. Files, arrays, takes made by hand and live frames go through it alike."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from ..core.layouts import FEET, LEG
from ..core.notices import Notice, grave, notice
from ..core.pose import PoseSequence
from ..core.take import Check, Handedness, Take
from ..signals.checks import chirality, upside_down
from .findings import findings_of

_ASKED = "sides-wrong-as-asked"
# By the verdict on left and right: what is wrong, and what to ask for.
_WRONG_SIDES = {
    "legs against arms": (
        "left and right of the legs contradict those of the arms",
        "swap-legs if the legs are in SPIN's order, or =ignore",
    ),
    "wrong": (
        "the body is mirrored or its left and right are exchanged",
        "mirror if the coordinates are mirrored, =swap if the names are, or =ignore",
    ),
}


def looked_at(take: Take) -> Take:
    """A take whose poses somebody else has put into it, with what is found in them; any other as it is. InputError as
    of `guarded`, by what the take is told."""
    poses = take.poses
    if poses is None or take.findings is not None or not _judged(poses):
        return take
    poses = guarded(poses, take.told.handedness, f"The poses of take {take.name}", take.told.check)
    return take.with_(poses=poses, findings=findings_of(poses)).saying(*poses.notices)


def doubts(poses: PoseSequence) -> tuple[Notice, ...]:
    """What is grave of all that is found in several poses of H36M17, but limbs that are exchanged for some rows."""
    return grave(findings_of(poses, swaps=())) if _judged(poses) and len(poses) > 1 else ()


def _judged(poses: PoseSequence) -> bool:
    return poses.layout.is_body and poses.frame.family in ("camera", "world")


def guarded(poses: PoseSequence, handedness: Handedness, where: str, check: Check = "refuse") -> PoseSequence:
    """The poses with left and right put right as asked; InputError when these, or up and down, are wrong.

    poses: H36M17 in 3D. where: what they come from, for the error. check: "off" takes both as they are. A doubt is a
    notice of theirs. Of a lift in the run the image may be upside down, which is told later.
    """
    if check == "off" and handedness == "refuse":
        handedness = "ignore"
    if any(each.code == _ASKED for each in poses.notices):  # whoever read them has looked
        return poses
    if handedness not in ("refuse", "ignore"):
        poses = repaired(poses, handedness).saying(notice("sides-put-right", repair=handedness))
    evidence = chirality(poses)
    if handedness != "refuse" and evidence.verdict != "good":
        poses = poses.saying(notice(_ASKED, verdict=evidence.verdict, evidence=str(evidence)))
    elif handedness == "refuse" and evidence.verdict in _WRONG_SIDES:
        what, how = _WRONG_SIDES[evidence.verdict]
        raise InputError("sides-swapped", f"{where}: {what}: {evidence}; pass --set read.handedness={how}.")
    for doubt in upside_down(poses) if check == "refuse" else ():
        if doubt.code == "upside-down":
            how = f'{doubt.text[:-1]}; for one pass --set read.check=off (check="off").'
            raise InputError("wrong-axes", f"{where}: {how}")
    return poses


def repaired(poses: PoseSequence, handedness: Handedness) -> PoseSequence:
    """Left and right put right as asked: "mirror" negates x, "swap" and "swap-legs" exchange joints' names."""
    if handedness == "mirror":
        return poses.moved(np.diag([-1.0, 1.0, 1.0])).noted("handedness", repair=handedness)
    order = np.arange(len(poses.layout))
    legs = [i for i, joint in enumerate(poses.layout.joints) if joint[2:] in LEG or joint in FEET]
    swapped = legs if handedness == "swap-legs" else order
    order[swapped] = poses.layout.mirror[swapped]
    covariance = poses.covariance
    return poses.with_(
        joints=poses.joints[:, order],
        confidence=poses.confidence[:, order],
        covariance=None if covariance is None else covariance[:, order],
    ).noted("handedness", repair=handedness)
