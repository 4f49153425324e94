"""Whether left and right of a skeleton are right, and putting them right."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from ..core.layouts import FEET
from ..core.notices import notice
from ..core.pose import PoseSequence
from ..core.take import Handedness
from ..signals.checks import chirality


def guarded(poses: PoseSequence, handedness: Handedness, where: str) -> PoseSequence:
    """The poses with left and right put right as asked; with "refuse", InputError when they are wrong.

    poses: H36M17 in 3D. where: what they come from, for the error. A doubt is a notice of theirs.
    """
    if handedness != "refuse":
        poses = repaired(poses, handedness)
        if handedness != "ignore":
            poses = poses.saying(notice("sides-put-right", repair=handedness))
        evidence = chirality(poses)
        if evidence.verdict != "good":
            doubt = notice("sides-wrong-as-asked", verdict=evidence.verdict, evidence=str(evidence))
            return poses.saying(doubt)
        return poses
    evidence = chirality(poses)
    if evidence.verdict == "legs against arms":
        raise InputError(
            "sides-swapped",
            f"{where}: left and right of the legs contradict those of the arms: {evidence}; "
            "pass --set read.handedness=swap-legs if the legs are in SPIN's order, or =ignore.",
        )
    if evidence.verdict == "wrong":
        raise InputError(
            "sides-swapped",
            f"{where}: the body is mirrored or its left and right are exchanged: {evidence}; "
            "pass --set read.handedness=mirror if the coordinates are mirrored, =swap if the names are, or =ignore.",
        )
    if evidence.verdict == "doubtful":
        return poses.saying(notice("sides-doubtful", evidence=str(evidence)))
    return poses


def repaired(poses: PoseSequence, handedness: Handedness) -> PoseSequence:
    """Left and right put right as asked: "mirror" negates x, "swap" and "swap-legs" exchange joints' names."""
    joints, root, feet = poses.joints, poses.root, poses.feet
    covariance, root_covariance = poses.covariance, poses.root_covariance
    order = np.arange(len(poses.layout))
    if handedness == "ignore":
        return poses
    if handedness == "mirror":
        mirror = np.array([-1.0, 1.0, 1.0])
        joints, root = joints * mirror, root if root is None else root * mirror
        signs = np.outer(mirror, mirror)
        covariance = covariance if covariance is None else covariance * signs
        root_covariance = root_covariance if root_covariance is None else root_covariance * signs
        feet = feet if feet is None else feet * mirror
    else:
        legs = poses.layout.indices([f"{side}_{part}" for side in "lr" for part in ("hip", "knee", "ankle")])
        swapped = legs if handedness == "swap-legs" else order
        order[swapped] = poses.layout.mirror[swapped]
        feet = feet if feet is None else feet[:, FEET.mirror]
    return poses.with_(
        joints=joints[:, order],
        confidence=poses.confidence[:, order],
        covariance=None if covariance is None else covariance[:, order],
        root=root,
        root_covariance=root_covariance,
        feet=feet,
    ).noted("handedness", repair=handedness)
