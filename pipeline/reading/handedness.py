"""Whether left and right of a skeleton are right, and putting them right."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ..core.errors import InputError
from ..core.layouts import FEET
from ..core.pose import PoseSequence
from ..signals.checks import chirality

Handedness = Literal["refuse", "mirror", "swap", "swap-legs", "ignore"]


def guarded(poses: PoseSequence, handedness: Handedness, where: str) -> tuple[PoseSequence, str]:
    """The poses with left and right put right as asked; with "refuse", InputError when they are wrong.

    poses: H36M17 in 3D. where: what they come from, for the error. -> the poses, and a doubt in words, which their
    history has as a warning; "" without one.
    """
    if handedness != "refuse":
        poses = repaired(poses, handedness)
        evidence = chirality(poses)
        good = evidence.verdict == "good"
        return _doubted(
            poses, "" if good else f"left and right are {evidence.verdict} as asked for: {evidence}"
        )
    evidence = chirality(poses)
    if evidence.verdict == "legs against arms":
        raise InputError(
            f"{where}: left and right of the legs contradict those of the arms: {evidence}; "
            "pass --handedness swap-legs if the legs are in SPIN's order, or --handedness ignore."
        )
    if evidence.verdict == "wrong":
        raise InputError(
            f"{where}: the body is mirrored or its left and right are exchanged: {evidence}; "
            "pass --handedness mirror if the coordinates are mirrored, --handedness swap if the names are, or "
            "--handedness ignore."
        )
    doubtful = evidence.verdict == "doubtful"
    return _doubted(poses, f"left and right are doubtful: {evidence}" if doubtful else "")


def _doubted(poses: PoseSequence, doubt: str) -> tuple[PoseSequence, str]:
    return poses.noted("handedness", warning=doubt) if doubt else poses, doubt


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
