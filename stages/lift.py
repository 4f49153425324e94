"""Lifting: 2D keypoints of any detector become a 3D skeleton, with our own network or another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..models import load_lifter, load_rectifier
from ..models.detector.scene_cuts import exchanges
from ..models.gravity.evidence import told_up
from ..models.gravity.levelling import known_moving_up, known_up
from ..models.lifter.builtin import KIND
from ..models.lifter.keypoints import visible_only
from ..models.lifter.otherwise import otherwise_better
from ..pipeline.core.conversions import remap
from ..pipeline.core.errors import InputError
from ..pipeline.core.intrinsics import undistorted
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.lifted import Lifted, ToLift
from ..pipeline.core.messages import how_many
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.take import Handedness, Take, Told
from ..pipeline.plugins.protocols import Lifter
from ..pipeline.reading.findings import findings_of, guarded
from ..pipeline.signals.checks import strays_of

_SIDES = ("mirrored", "legs-against-arms", "left-and-right")  # doubts of handedness


@dataclass(frozen=True)
class Lift:
    """The stage. A lifter with "up" among its `takes` lifts a second time, if the images or the user say which way is
    up and the first lift does not contradict that.

    lifter: "pcnet3d" (built in), the name of another, an .onnx file of one that was trained here, or a function
    (models.lifter.load). unit: of what a function answers.
    """

    lifter: str | Callable[..., Any] = "pcnet3d"
    unit: str | None = None
    _opened: Lifter = field(init=False, repr=False, compare=False)

    name: ClassVar[str] = "lift"
    needs: ClassVar[tuple[str, ...]] = ("keypoints",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    reads: ClassVar[tuple[str, ...]] = (
        "camera", "focal_px", "gravity", "pitch_deg", "roll_deg", "image_size"
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Opens the lifter, so that a run ends before its detector has looked at the whole video in vain."""
        object.__setattr__(self, "_opened", load_lifter(self.lifter, self.unit))

    def unit_of(self, before: str, told: Told) -> str:
        """The lifter's unit, if it is known before the lift."""
        return self._opened.unit

    def __call__(self, take: Take) -> Take:
        asked, lifted, strays = self._lifted_best(take)
        if strays:
            reason = "the whole body leaps there, to another place or with left and right exchanged"
            take = take.saying(notice("frames-without-joints", weight="repair", frames=strays, reason=reason))
        poses = self._guarded(lifted, take.told.handedness)
        findings = findings_of(poses)
        if not take.moving:
            findings = (*findings, *_elsewhere(asked.keypoints, asked.image_size))
        if lifted.kind == KIND and not any(each.code in _SIDES for each in findings):
            findings = (*findings, *otherwise_better(asked, lifted.poses, str(self.lifter)))
        notices = _focal(lifted)
        if frames := lifted.frames_without_joints:
            reason = "keypoints are missing for too long"
            notices.append(notice("frames-without-joints", frames=frames, reason=reason))
        return take.with_(poses=poses, findings=findings).saying(*notices, *poses.notices)

    def poses_of(self, take: Take) -> PoseSequence:
        """The lift alone, as it stands beside poses of another lifter: nothing is looked for in it or its keypoints.
        InputError as of a run, and where its left and right are wrong."""
        return self._guarded(self._lifted_best(take)[1], "refuse")

    def _guarded(self, lifted: Lifted, handedness: Handedness) -> PoseSequence:
        poses = lifted.noted()
        poses = poses.with_(made_by=replace(poses.made_by, in_run=True))
        return guarded(poses, handedness, f"The lift by {lifted.model}")

    def _lifted_best(self, take: Take) -> tuple[ToLift, Lifted, int]:
        """By up where that is known: what was asked, the answer, and in how many frames keypoints were left out."""
        size = take.image_size
        keypoints, takes, strays = take.need("keypoints"), self._opened.takes, 0
        if "gaps" in takes and keypoints.time_s is not None:
            visible = visible_only(keypoints, size)
            keypoints, strays = _without_strays(visible, keypoints)
        asked = self._asked(take, keypoints, size)
        lifted = self._lifted(asked)
        if "up" in takes and (up := _known_up(take, lifted.poses)) is not None:
            asked = replace(asked, up=up)
            lifted = self._lifted(asked)
        return asked, lifted, strays

    def _asked(self, take: Take, keypoints: PoseSequence, size: tuple[int, int] | None) -> ToLift:
        """keypoints: of the filmed image; its border is compared with them, and then the lens's distortion undone."""
        camera, takes = take.camera, self._opened.takes
        intrinsics = camera.intrinsics if camera else None
        if intrinsics is not None:
            if "images" not in takes:
                keypoints = keypoints.with_(joints=undistorted(keypoints.joints, intrinsics))
            keypoints = keypoints.noted(
                "undistort", camera=intrinsics.name, file=Path(intrinsics.source).name
            )
        guessed = camera is not None and camera.focal_source == "prior"
        focal_px = camera.focal_px if camera else take.told.focal_px
        return ToLift(
            keypoints,
            size,
            None if guessed and "guessed focal" not in takes else focal_px,
            take.video,
            intrinsics,
            focal_guessed=guessed,
        )

    def _lifted(self, asked: ToLift) -> Lifted:
        """InputError for a lifter of another package that answers something else."""
        lifted = self._opened.lift(asked)
        rows = len(lifted.poses) if isinstance(lifted, Lifted) else type(lifted).__name__
        if rows != len(asked.keypoints):
            raise InputError(
                "plugin-broken",
                f"Expected from the lifter {self._opened.method} a Lifted of "
                f"{how_many(len(asked.keypoints), 'row')}, got {rows}: repair its package.",
            )
        return lifted


def _known_up(take: Take, poses: PoseSequence) -> np.ndarray | None:
    """(3,) unit, which way is up in a camera that stands still, or (T, 3) in one that moves, where that is known well;
    None else."""
    told, looks = told_up(take.told), take.camera.looks if take.camera else ()
    if not (told or looks):
        return None
    rectifier = load_rectifier("pcnet")
    if take.moving:
        return known_moving_up(poses, rectifier, looks)
    return known_up(poses, rectifier, told, looks[0] if looks else None)


def _without_strays(visible: PoseSequence, keypoints: PoseSequence) -> tuple[PoseSequence, int]:
    """The keypoints that were seen, without frames that show somebody or something else; and how many those are."""
    body = remap(keypoints, H36M17)
    strays = strays_of(body.with_(joints=body.joints - body.joint("pelvis")[:, None]))
    hidden = np.broadcast_to(strays[:, None], visible.confidence.shape)
    return visible.without(hidden), int(strays.sum())


def _elsewhere(keypoints: PoseSequence, image_size: tuple[int, int] | None) -> list[Notice]:
    """Where somebody else goes on, before a camera that stands still: a tracker has gone on to another."""
    time_s = keypoints.time_s
    if time_s is None or any(each.code.startswith("leap-") for each in keypoints.notices):
        return []
    keypoints, _ = _without_strays(visible_only(keypoints, image_size), keypoints)
    notices = []
    for row, sizes in exchanges(time_s, keypoints.joints.astype(np.float64))[:1]:
        where: dict[str, Any] = {"sizes": sizes, "frame": int(keypoints.frame_index[row]), "unseen": ""}
        notices.append(notice("leap-between-people", weight="suspicious", **where))
    return notices


def _focal(lifted: Lifted) -> list[Notice]:
    """What the focal length was, or would be, good for."""
    focal_px, is_known = lifted.focal_px, lifted.focal_known
    if lifted.placed:
        at = "" if focal_px is None else f", at a focal length of {focal_px:.0f} pixels"
        reason = f"the path of the pelvis is the lifter's own{at}"
        return [notice("errors-unknown", what="paths, velocities and accelerations", reason=reason)]
    if focal_px is None or is_known:
        return []
    return [notice("focal-guessed", focal_px=focal_px)]
