"""Rectification: from the camera's axes to the canonical frames BODY and LEVEL (design.md section 4)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ..models.angle_error.joint_noise import FOCAL_HEADING, turns_of
from ..models.common.residuals import stated_spread
from ..models.gravity.evidence import told_up
from ..models.gravity.levelling import (
    Levelled,
    level_moving,
    level_people,
    level_static,
    level_world,
    timed,
    times_of,
    why_not,
)
from ..models.gravity.votes import PersonFrames, take_rotation
from ..models.rectifier.load import Checked, load_rectifier
from ..pipeline.core.camera import Camera as View
from ..pipeline.core.conversions import change_frame
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA, LEVEL, Z_UP, Frame
from ..pipeline.core.layouts import Layout
from ..pipeline.core.notices import Notice, grave, notice, verdict, without_doubles
from ..pipeline.core.pose import PoseSequence, Rectified
from ..pipeline.core.rotations import rotate, transpose
from ..pipeline.core.take import CameraMotion, Check, Take, Told
from ..pipeline.plugins.protocols import Rectifier
from ..pipeline.reading.findings import doubts
from ..pipeline.reading.given import Meaning, poses_given
from ..pipeline.signals.checks import nobody_upright


@dataclass(frozen=True)
class Rectify:
    """The stage.

    rectifier: "pcnet", "paper", "geometric", or a trained network's .onnx file.
    """

    rectifier: str = "pcnet"

    name: ClassVar[str] = "rectify"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("rectified",)
    reads: ClassVar[tuple[str, ...]] = ("camera", "gravity", "pitch_deg", "roll_deg")

    def check_told(self, told: Told) -> None:
        """InputError for a rectifier that cannot be used, before a run has looked at the whole video in vain."""
        _facing(self.rectifier)

    def __call__(self, take: Take) -> Take:
        return self.together([take])[0]

    def together(self, takes: Sequence[Take]) -> list[Take]:
        """Several people of one recording in one LEVEL. Its -X is the camera's horizontal viewing direction reversed;
        poses in a world's axes keep that world's axes. One person without others gets a heading of their own.

        A static camera's up is pooled over the people (level_people). With a moving camera each person has their own up
        in each frame, and all share the heading. InputError for poses in a camera's axes and in a world's.
        """
        people = [take.need("poses") for take in takes]
        told = replace(takes[0].told, camera="moving") if takes[0].moving else takes[0].told
        levelled = _rectify(people, self.rectifier, told, takes[0].camera)
        return [_filled(take, *each) for take, each in zip(takes, levelled, strict=True)]


def _filled(take: Take, rectified: Rectified, notices: list[Notice]) -> Take:
    if rectified.level_ok and (turning := turns_of(take.with_(rectified=rectified))) is not None:
        by_focal = FOCAL_HEADING * np.degrees(turning.heading)
        rectified = replace(rectified, error_deg=np.hypot(rectified.error_deg, by_focal))
    rectified, more = _judged(rectified, take.judged)
    return take.with_(rectified=rectified).saying(*notices, *more)


def _judged(rectified: Rectified, judged: Sequence[Notice]) -> tuple[Rectified, list[Notice]]:
    """With no bound of up where nobody knows it, and what is said of up. judged: what the poses are
    judged by."""
    notices = []
    if not rectified.level_ok:
        notices.append(notice("not-levelled", reason=rectified.level_reason))
    own = sum(rectified.up_shares.get(source, 0.0) for source in ("frames", "feet", "floor"))
    if own > 0.5 and verdict(judged) == "unusable":  # up rests mostly on these poses
        rectified = replace(rectified, up_bound_deg=np.full(len(rectified.level), np.nan))
    if not any(finding.code == "upside-down" for finding in judged):
        notices += nobody_upright(rectified)
    return rectified, notices


def rectify(
    poses: PoseSequence | Any,
    rectifier: str | Rectifier = "pcnet",
    camera: CameraMotion = "static",
    *,
    fps: float | None = None,
    axes: str | None = None,
    joints: Layout | str | None = None,
    unit: str | None = None,
    check: Check = "refuse",
    gravity: tuple[float, float, float] | None = None,
    pitch_deg: float | None = None,
    roll_deg: float | None = None,
    view: View | None = None,
) -> Rectified:
    """Turn a skeleton into BODY (upright and facing -X in every frame) and LEVEL (one upright frame for the take).

    poses: an array (T, J, 3) or, of one frame, (J, 3), of numbers of any kind, a torch tensor too; or a PoseSequence of
    H36M17 in the axes of a camera, or of a world frame whose gravity is known: then only the heading is estimated. The
    joints are taken relative to the pelvis; NaN stays NaN. "source" in the rotations' names are the axes that the poses
    come in. Poses without time stamps count as 30 frames a second.

    fps: frames a second. axes, joints, unit: of an array: "camera" (x right, y down, z away; the default),
    "camera-y-up", "z-up" or "y-up"; a public layout or its name, H36M17 by default; "m", "mm", "cm", "inch" or
    "arbitrary", the default.
    check: "off" looks for nothing, and takes a body that is mirrored, upside down or in another order of joints as it
    is. By default what else is found is a notice of `level`, and a Python warning if it is grave.

    camera, gravity, pitch_deg, roll_deg: as in pipeline.core.take.Told. view: what the images say
    (stages.calibrate). With a static camera the take has one up. Every frame votes on it (models/gravity/votes.py),
    and so does the floor under the feet if the source knows where the person is (its root).
    With a moving camera up changes smoothly, and LEVEL has the camera's heading: horizontal directions are relative to
    the camera.

    A frame with too few torso joints has a NaN rotation. A take that cannot be levelled has level_ok False and a
    reason, and never raises. InputError for another layout, shape or frame, for a body that is mirrored or upside down,
    as of a file, and if the camera's lean is given twice.
    """
    told = Told(camera, gravity=gravity, pitch_deg=pitch_deg, roll_deg=roll_deg, check=check)
    source = poses_given(poses, Meaning(axes, joints, unit), fps, told)
    ((rectified, notices),) = _rectify([source], rectifier, told, view)
    doubted = doubts(source) if check == "refuse" else ()
    rectified, more = _judged(rectified, doubted)
    all_notices = without_doubles((*rectified.level.notices, *doubted, *notices, *more))
    for each in grave(all_notices) if check == "refuse" else ():
        warnings.warn(each.text, stacklevel=2)
    return replace(rectified, level=rectified.level.with_(notices=all_notices))


def _rectify(
    people: Sequence[PoseSequence], rectifier: str | Rectifier, told: Told, view: View | None
) -> list[tuple[Rectified, list[Notice]]]:
    """Of each of the people, in the order given, several in one LEVEL."""
    up, together = told_up(told), len(people) > 1
    sources = [_checked(poses) for poses in people]
    families = {source.frame.family for source in sources}
    if len(families) > 1:
        raise InputError(
            "wrong-axes", "Expected people in one frame, got some in a camera's axes and some in a world's."
        )
    if families == {"world"}:
        if up or told.moving:
            raise InputError(
                "option-conflict",
                f"These poses know their own gravity ({sources[0].frame}); leave camera, gravity, pitch and roll out.",
            )
        levels = [
            level_world(
                _in(source, Z_UP).joints, times_of(source), together, source.made_by.kind == "measured"
            )
            for source in sources
        ]
        reference, method = Z_UP, "gravity"
    else:
        chosen = _facing(rectifier)
        frames = [_seen(source, chosen, told.moving) for source in sources]
        look = view.looks[0] if view and view.looks else None
        if told.moving:
            levels = [
                level_moving(person, timed(view.looks if view else (), source))
                for person, source in zip(frames, sources, strict=True)
            ]
        elif together:
            levels = level_people(frames, up, look)
        else:
            levels = [level_static(person, up, look) for person in frames]
        reference, method = CAMERA, chosen.method
    return [
        (_rectified(source, reference, levelled, method, told), [*levelled.up.notices])
        for source, levelled in zip(sources, levels, strict=True)
    ]


def _facing(rectifier: str | Rectifier) -> Rectifier:
    """The rectifier, loaded; InputError for one that does not tell where a body faces."""
    chosen = load_rectifier(rectifier) if isinstance(rectifier, str) else rectifier
    if getattr(chosen, "targets", "body") != "body":
        raise InputError(
            "wrong-network",
            f"{rectifier} was trained on a data set's own axes, which do not tell where a body faces; choose a "
            'network trained with targets = "body".',
        )
    return Checked(chosen)


def _checked(poses: PoseSequence) -> PoseSequence:
    """The poses relative to the pelvis; InputError for a layout or frame that cannot be rectified."""
    if not poses.layout.is_body:
        raise InputError(
            "wrong-content",
            f"rectify needs joints in layout H36M17, got {poses.layout.name}; use remap first.",
        )
    if poses.frame.family not in ("camera", "world") or not poses.frame.right_handed:
        raise InputError(
            "wrong-axes",
            f"rectify needs joints in right-handed axes of a camera or a world, got {poses.frame}.",
        )
    return change_frame(poses, poses.frame.with_(origin="pelvis"))


def _seen(source: PoseSequence, rectifier: Rectifier, moving: bool) -> PersonFrames:
    poses, time_s = _in(source.without_feet, CAMERA), times_of(source)
    if moving:  # every frame has an up of its own
        R, error_deg = rectifier.rotation(poses.joints)
    else:
        R, error_deg = take_rotation(rectifier, poses.joints, time_s, source.seams)
    name, spread = f"person {source.person}", stated_spread(poses)
    return PersonFrames(poses.joints, R, error_deg, time_s, source.seams, poses.own_root, name, spread)


def _rectified(
    source: PoseSequence, reference: Frame, levelled: Levelled, method: str, told: Told
) -> Rectified:
    """levelled: in the axes of `reference`, CAMERA or Z_UP."""
    R_source_from_reference = source.frame.basis @ reference.basis.T
    R_source_from_body = R_source_from_reference @ levelled.R_camera_from_body
    R_source_from_level = R_source_from_reference @ levelled.R_camera_from_level
    reason = why_not(levelled)
    given = {name: getattr(told, name) for name in ("gravity", "pitch_deg", "roll_deg")}
    options: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    camera: CameraMotion = "moving" if told.moving else "static"
    noted = source.noted("rectify", method=method, camera=camera, level_heading=levelled.heading, **options)
    return Rectified(
        level=noted.moved(transpose(R_source_from_level), frame=LEVEL.with_(unit=source.frame.unit)),
        R_source_from_body=R_source_from_body,
        R_source_from_level=R_source_from_level,
        error_deg=levelled.error_deg,
        method=method,
        level_heading=levelled.heading,
        level_ok=not reason,
        level_reason=reason,
        source=source.frame,
        camera=None if reference is Z_UP else camera,
        up_error_deg=levelled.up_error_deg,
        up_bound_deg=levelled.up_bound_deg,
        up_votes=rotate(R_source_from_reference, levelled.votes),
        up_shares=levelled.up.shares,
        up_own={name: (R_source_from_reference @ up, error) for name, (up, error) in levelled.up.own.items()},
    )


def _in(source: PoseSequence, reference: Frame) -> PoseSequence:
    return change_frame(source, reference.with_(origin="pelvis", unit=source.frame.unit))
