"""Lifting: 2D keypoints of any detector become a 3D skeleton, with our own network or another."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..models import load_lifter, load_rectifier
from ..models.gravity import known_moving_up, known_up, told_up
from ..models.lifter.answers import Answers, load_answers
from ..models.lifter.builtin import OwnLifter
from ..models.lifter.images import ImageLifter
from ..models.lifter.input import UNDISTORT, refuse_outside
from ..models.lifter.scaling import KINDS
from ..pipeline.core.errors import InputError
from ..pipeline.core.intrinsics import Intrinsics, undistorted
from ..pipeline.core.layouts import H36M17, remap
from ..pipeline.core.messages import how_many
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.core.take import Event, Take, Told
from ..pipeline.files.video_frames import image_size
from ..pipeline.plugins.protocols import Lifter
from ..pipeline.reading.handedness import Handedness, guarded
from ..pipeline.signals.checks import implausible, strays_of
from ..pipeline.signals.findings import findings_of
from ..pipeline.signals.visibility import seen_only

_TOLD = ("model", "kind", "focal_known")  # by every lifter of its lift (plugins.protocols.Lifter)


@dataclass(frozen=True)
class Lift:
    """The stage. Our own lifter lifts again where it is known which way is up, from the images or from the user, and
    the first lift does not contradict that.

    lifter: "pcnet3d", the built-in one, or an .onnx file; lifter_kind: what that is, where its shapes leave it open
    (models.load_lifter). flip: average with the lift of the mirrored person. handedness: what to do when left and right
    of the lift look exchanged. checkpoint: a file for what a lifter that looks at the images has answered so far,
    written every minute. resume: the file of an interrupted run to go on from.
    """

    lifter: str = "pcnet3d"
    lifter_kind: str | None = None
    flip: bool = False
    handedness: Handedness = "refuse"
    checkpoint: Path | None = None
    resume: Path | None = None
    _opened: Lifter = field(init=False, repr=False, compare=False)

    name: ClassVar[str] = "lift"
    needs: ClassVar[tuple[str, ...]] = ("keypoints",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    reads: ClassVar[tuple[str, ...]] = (
        "camera", "focal_px", "gravity", "pitch_deg", "roll_deg", "image_size"
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Opens the lifter, so that a run ends before its detector has looked at the whole video in vain."""
        object.__setattr__(self, "_opened", load_lifter(self.lifter, self.lifter_kind))

    def unit_of(self, before: str, told: Told) -> str:
        """A pipeline.plugins.protocols.ScalingStage: the lifter's, where that says it."""
        return getattr(self._opened, "unit", "")

    def __call__(self, take: Take) -> Take:
        size = image_size(take)
        keypoints, intrinsics = take.need("keypoints"), take.camera.intrinsics if take.camera else None
        if isinstance(self._opened, OwnLifter) and keypoints.time_s is not None:
            keypoints, strays = _without_strays(seen_only(keypoints, size), keypoints)
            if strays:
                text = (
                    f"{how_many(strays, 'frame')} of 2D keypoints, between leaps of the whole "
                    "person, left out of the lift."
                )
                take = take.saying(Event("repair", text))
        if intrinsics is not None:  # after what compares keypoints with the border of the filmed image
            keypoints = self._undistorted(keypoints, intrinsics, size)
        focal_px, guessed = self._focal_px(take)
        poses = self._lifted(take, keypoints, size, focal_px)
        if isinstance(self._opened, OwnLifter) and (up := _known_up(take, poses)) is not None:
            poses = self._opened.lift(keypoints, size, focal_px, self.flip, take.video, up)
        if guessed:  # what phones usually have is no knowledge of this camera
            last = poses.history[-1]
            last = replace(last, options={**last.options, "focal_known": False})
            poses = poses.with_(history=(*poses.history[:-1], last))
        poses = poses.with_(made_by=MadeBy("estimated", self._opened.method))
        said = _said(poses, self._opened)
        poses = guarded(poses, self.handedness, f"The lift by {self._opened.method}")
        doubts = [str(step.options["warning"]) for step in poses.history if "warning" in step.options]
        told = [event.text for event in take.events]  # the keypoints' own are in their history too
        doubts = [text for text in doubts if text not in told]
        if said.get("joints_on_a_line"):
            text = f"{said['joints_on_a_line']} missing keypoints were put on a line between where they were seen."
            take = take.saying(Event("repair", text))
        warnings = (*_gaps(said), *doubts, *implausible(poses))
        events = (
            Event("note", _who(said)),
            *(Event("note", text) for text in _focal(said)),
            *(Event("warning", text) for text in warnings),
        )
        return take.with_(poses=poses, findings=findings_of(poses)).saying(*events)

    def _undistorted(
        self, keypoints: PoseSequence, intrinsics: Intrinsics, size: tuple[int, int] | None
    ) -> PoseSequence:
        if size is not None:
            refuse_outside(keypoints, np.array(size))
        # A lifter of images looks at distorted ones, and straightens what it sees itself.
        if not isinstance(self._opened, ImageLifter):
            keypoints = keypoints.with_(joints=undistorted(keypoints.joints, intrinsics))
        return keypoints.noted(UNDISTORT, camera=intrinsics.name, file=Path(intrinsics.source).name)

    def _lifted(
        self, take: Take, keypoints: PoseSequence, size: tuple[int, int] | None, focal_px: float | None
    ) -> PoseSequence:
        if not isinstance(self._opened, ImageLifter):
            return self._opened.lift(keypoints, size, focal_px, self.flip, take.video)
        before = None if self.resume is None else load_answers(self.resume)
        intrinsics = take.camera.intrinsics if take.camera else None
        return self._opened.lift(
            keypoints, size, focal_px, self.flip, take.video, intrinsics, before, self._keep
        )

    def _keep(self, answers: Answers) -> None:
        if self.checkpoint is not None:
            answers.save(self.checkpoint)

    def _focal_px(self, take: Take) -> tuple[float | None, bool]:
        """The focal length to lift with, in pixels, and whether it is a guess, which is good enough for our own lifter
        only: others turn the whole body by it."""
        camera = take.camera
        if camera is None:
            return take.told.focal_px, False
        if camera.focal_source != "prior":
            return camera.focal_px, False
        return (camera.focal_px, True) if isinstance(self._opened, OwnLifter) else (None, False)


def _known_up(take: Take, poses: PoseSequence) -> np.ndarray | None:
    """(3,) unit, which way is up in a camera that stands still, or (T, 3) in one that moves, where that is known well;
    None else."""
    told, looks = told_up(take.told), take.camera.looks if take.camera else ()
    if not (told or looks):
        return None
    rectifier = load_rectifier("pcnet")
    if take.told.moving:
        return known_moving_up(poses, rectifier, looks)
    return known_up(poses, rectifier, told, looks[0] if looks else None)


def _without_strays(seen: PoseSequence, keypoints: PoseSequence) -> tuple[PoseSequence, int]:
    """The keypoints that were seen, without frames that show somebody or something else; and how many those are."""
    body = remap(keypoints, H36M17)
    strays = strays_of(body.with_(joints=body.joints - body.joint("pelvis")[:, None]))
    joints = np.where(strays[:, None, None], np.nan, seen.joints)
    return seen.with_(joints=joints, confidence=np.where(strays[:, None], 0.0, seen.confidence)), int(
        strays.sum()
    )


def _said(poses: PoseSequence, lifter: Lifter) -> dict[str, Any]:
    """What a lifter says of its lift; InputError for one of another package that does not say it."""
    last = poses.history[-1] if poses.history else None
    said = last.options if last is not None and last.name == "lift" else {}
    if lacking := [key for key in _TOLD if key not in said]:
        raise InputError(
            f"Expected from the lifter {lifter.method} poses whose history ends with the step 'lift' and its options "
            f"{', '.join(_TOLD)}; got none of {', '.join(lacking)}: repair its package."
        )
    return said


def _who(said: dict[str, Any]) -> str:
    if said["kind"] == "pcnet3d":
        return f"The poses are the built-in lifter's, from the 2D keypoints (network {said['model']})."
    licence = f", published under {said['licence']}" if "licence" in said else ""
    return f"The poses are the lift by {said['model']}, a network of the kind {said['kind']}{licence}."


def _focal(said: dict[str, Any]) -> list[str]:
    """What the focal length was, or would be, good for."""
    known = said["focal_known"]
    if said["kind"] == "pcnet3d":
        guess = f"The focal length is unknown and taken for {said['focal_px']:.0f} pixels (--focal)."
        return [] if known else [guess]
    if said.get("placed_by_the_lifter"):
        path = "The pelvis's path before the camera is the lifter's own"
        return [f"{path}, at a focal length of {said['focal_px']:.0f} pixels; it states no error."]
    if said.get("focal_of_the_network"):
        guess = (
            f"The lifter takes the focal length for {said['focal_px']:.0f} pixels, which nobody has measured"
        )
        return [f"{guess}, so its own path of the pelvis before the camera is not used (--focal)."]
    if "bearing_deg" not in said:
        text = "The lifter sees where in the picture the person is; the focal length is not used."
        return [text] if known and said["kind"] in KINDS else []  # another package's may use it
    least, most = said["bearing_deg"]
    text = (
        "The lifter sees the person in a crop and answers along the ray to the person: a bearing of b degrees shifts "
        f"the heading by about b, here by {least:.0f} to {most:.0f} degrees if the focal length is "
        f"{said['focal_px']:.0f} pixels; --focal PIXELS takes it out."
    )
    return [] if known else [text]


def _gaps(said: dict[str, Any]) -> list[str]:
    texts = {
        "frames_without_joints": "frames have no keypoints for too long to be lifted.",
        "frames_without_person": "frames have keypoints, but the lifter sees nobody in their pictures.",
        "frames_without_numbers": "frames have keypoints, but the lifter's answer to them is no number.",
        "frames_without_scale": "frames have limbs that are longer in depth alone than any person's.",
    }
    return [f"{said[key]} {text}" for key, text in texts.items() if said.get(key)]
