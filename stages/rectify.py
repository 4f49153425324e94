"""Rectification: from the camera's axes to the canonical frames BODY and LEVEL (design.md section 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ..models import load_rectifier
from ..models.gravity import Evidence, direction
from ..models.gravity.levelling import (
    WINDOW_S,
    Camera,
    Levelled,
    level_frame,
    level_moving,
    level_static,
    why_not,
)
from ..models.gravity.people import Seen, level_people
from ..models.synthetic.cameras import view_rotation
from ..pipeline.camera import Camera as View
from ..pipeline.camera import Look
from ..pipeline.canonical import R_world_from_body
from ..pipeline.errors import InputError
from ..pipeline.frames import BODY, CAMERA, LEVEL, Z_UP, Frame, change_frame
from ..pipeline.layouts import H36M17
from ..pipeline.plugins.protocols import Rectifier
from ..pipeline.pose import PoseSequence, Rectified
from ..pipeline.rotations import rotate, transpose
from ..pipeline.take import Event, Take

_KNOWN_DEG = 1.0  # error of a camera's pitch, roll or gravity vector that the user states


@dataclass(frozen=True)
class Rectify:
    """The stage.

    rectifier: "pcnet", "paper", "geometric", or a trained network's .onnx file. camera: "static" for one that stands
    still during the take, "moving" for one that pans or is carried. gravity: which way things fall, in the camera's
    axes (x right, y down, z away). pitch_deg, roll_deg: of the camera, positive when it looks down, and when the
    picture's content turns counter-clockwise. window_s: of a moving camera, how far in time frames share their up,
    the standard deviation of a Gaussian.
    """

    rectifier: str = "pcnet"
    camera: Camera = "static"
    gravity: tuple[float, float, float] | None = None
    pitch_deg: float | None = None
    roll_deg: float | None = None
    window_s: float = WINDOW_S

    name: ClassVar[str] = "rectify"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("rectified",)

    def __call__(self, take: Take) -> Take:
        ((rectified, events),) = _rectify([take.need("poses")], False, view=take.camera, **vars(self))
        return _filled(take, rectified, events)

    def together(self, takes: Sequence[Take]) -> list[Take]:
        """Several people of one recording, in one LEVEL (rectify_together)."""
        people = [take.poses for take in takes if take.poses is not None]
        view = next((take.camera for take in takes), None)
        found = _rectify(people, True, view=view, **vars(self))
        return [_filled(take, *each) for take, each in zip(takes, found, strict=True)]


def _filled(take: Take, rectified: Rectified, events: list[Event]) -> Take:
    lost = int(np.isnan(rectified.R_source_from_body).any(axis=(1, 2)).sum())
    if lost:
        text = f"{lost} of {len(rectified.body)} frames have too few torso joints to rectify."
        events = [*events, Event("warning", text)]
    if not rectified.level_ok:
        events = [*events, Event("warning", f"The take could not be levelled: {rectified.level_reason}.")]
    return take.with_(rectified=rectified).saying(*events)


def rectify(
    poses: PoseSequence,
    rectifier: str | Rectifier = "pcnet",
    camera: Camera = "static",
    *,
    gravity: tuple[float, float, float] | None = None,
    pitch_deg: float | None = None,
    roll_deg: float | None = None,
    window_s: float = WINDOW_S,
    view: View | None = None,
) -> Rectified:
    """Turn a skeleton into BODY, upright and facing -X in every frame, and LEVEL, one upright frame a take.

    poses: H36M17 in the axes of a camera, or of a world frame whose gravity is known: then nothing is estimated
    but the heading. The joints are taken relative to the pelvis; NaN stays NaN. "source" in the rotations' names
    are the axes that the poses come in. Poses without time stamps count as 30 frames a second.

    camera, gravity, pitch_deg, roll_deg, window_s: of Rectify. view: what the images say (stages.calibrate). A static
    camera has one up for the take, which every frame votes on (models/gravity/votes.py), as does the floor under the
    feet when the poses know where the person is (their root; models/gravity/floor.py); a moving one a smooth up, and
    LEVEL's heading is then the camera's, so that horizontal directions are relative to it.

    A frame with too few torso joints has a NaN rotation. A take that cannot be levelled has level_ok False and a
    reason, and never raises. InputError for another layout or frame, and for a camera that is told twice how it leans.
    """
    ((rectified, _),) = _rectify(
        [poses], False, rectifier, camera, gravity, pitch_deg, roll_deg, window_s, view
    )
    return rectified


def rectify_together(
    people: Sequence[PoseSequence],
    rectifier: str | Rectifier = "pcnet",
    camera: Camera = "static",
    *,
    gravity: tuple[float, float, float] | None = None,
    pitch_deg: float | None = None,
    roll_deg: float | None = None,
    window_s: float = WINDOW_S,
    view: View | None = None,
) -> tuple[Rectified, ...]:
    """Several people of one recording in one LEVEL, whose -X is the camera's horizontal viewing direction reversed; of
    poses in a world's axes, that world's own. Arguments and errors of rectify.

    A static camera's up is pooled over the people (models/gravity/people.py). Before a moving camera each person has
    their own up, as each frame has, and the common heading.
    """
    found = _rectify(people, True, rectifier, camera, gravity, pitch_deg, roll_deg, window_s, view)
    return tuple(rectified for rectified, _ in found)


def _rectify(
    people: Sequence[PoseSequence],
    together: bool,
    rectifier: str | Rectifier,
    camera: Camera,
    gravity: tuple[float, float, float] | None,
    pitch_deg: float | None,
    roll_deg: float | None,
    window_s: float,
    view: View | None,
) -> list[tuple[Rectified, list[Event]]]:
    """Of each of the people, in the order given; together: in one LEVEL."""
    if not 0 < window_s < np.inf:
        raise InputError(f"Expected a window_s of more than 0 seconds, got {window_s:g}.")
    told = _told(gravity, pitch_deg, roll_deg)
    sources = [_checked(poses) for poses in people]
    families = {source.frame.family for source in sources}
    if len(families) > 1:
        raise InputError("Expected people in one frame, got some in a camera's axes and some in a world's.")
    said: dict[str, Any] = {"gravity": gravity, "pitch_deg": pitch_deg, "roll_deg": roll_deg}
    if camera == "moving":
        said["window_s"] = window_s
    said = {name: value for name, value in said.items() if value is not None}
    if families == {"world"}:
        if told or camera != "static":
            raise InputError(
                f"These poses know their own gravity ({sources[0].frame}); leave camera, gravity, pitch and roll out."
            )
        known_up = [_own_gravity(_in(source, Z_UP).joints, _times(source), together) for source in sources]
        return [
            (_rectified(source, Z_UP, levelled, "gravity", camera, said), [])
            for source, levelled in zip(sources, known_up, strict=True)
        ]
    chosen = load_rectifier(rectifier) if isinstance(rectifier, str) else rectifier
    if getattr(chosen, "targets", "body") != "body":
        raise InputError(
            f"{rectifier} was trained on a data set's own axes, which do not tell where a body faces; choose a "
            'network trained with targets = "body".'
        )
    if camera == "moving" and told:
        raise InputError("A moving camera has no one pitch, roll or gravity; leave them out.")
    seen = [_seen(source, chosen) for source in sources]
    events: list[list[Event]] = [[] for _ in seen]
    look = view.looks[0] if view and view.looks else None
    if camera == "moving":
        answers = [
            level_moving(
                one.R_camera_from_body, one.error_deg, one.time_s, one.seams, window_s, _looks(view, source)
            )
            for one, source in zip(seen, sources, strict=True)
        ]
    elif together:
        found = level_people(seen, told, look)
        answers = list(found.levelled)
        events = [
            [*_drift_event(levelled, source), *_apart_event(apart)]
            for levelled, source, apart in zip(answers, sources, found.apart_deg, strict=True)
        ]
    else:
        answers = [
            level_static(
                one.joints,
                one.R_camera_from_body,
                one.error_deg,
                one.time_s,
                one.seams,
                told,
                one.root,
                None,
                look,
            )
            for one in seen
        ]
        events = [_drift_event(levelled, source) for levelled, source in zip(answers, sources, strict=True)]
    events = [
        [*(Event("warning", text) for text in levelled.warnings), *happened]
        for levelled, happened in zip(answers, events, strict=True)
    ]
    return [
        (_rectified(source, CAMERA, levelled, chosen.method, camera, said), happened)
        for source, levelled, happened in zip(sources, answers, events, strict=True)
    ]


def _checked(poses: PoseSequence) -> PoseSequence:
    """The poses relative to the pelvis; InputError for a layout or frame that cannot be rectified."""
    if poses.layout != H36M17:
        raise InputError(f"rectify needs joints in layout H36M17, got {poses.layout.name}; use remap first.")
    if poses.frame.family not in ("camera", "world") or not poses.frame.right_handed:
        raise InputError(
            f"rectify needs joints in right-handed axes of a camera or a world, got {poses.frame}."
        )
    return change_frame(poses, poses.frame.with_(origin="pelvis"))


def _times(source: PoseSequence) -> np.ndarray:
    return np.arange(len(source)) / 30 if source.time_s is None else source.time_s


def _seen(source: PoseSequence, rectifier: Rectifier) -> Seen:
    poses = _in(source, CAMERA)
    R, error_deg = rectifier.rotation(poses.joints)
    name, times = f"person {source.person}", _times(source)
    return Seen(name, poses.joints, R, error_deg, times, source.seams, poses.root)


def _rectified(
    source: PoseSequence,
    reference: Frame,
    levelled: Levelled,
    method: str,
    camera: Camera,
    said: dict[str, Any],
) -> Rectified:
    """levelled: in the axes of `reference`, CAMERA or Z_UP. said: what the history notes besides."""
    R_source_from_reference = source.frame.basis @ reference.basis.T
    R_source_from_body = R_source_from_reference @ levelled.R_camera_from_body
    R_source_from_level = R_source_from_reference @ levelled.R_camera_from_level
    reason = why_not(levelled, _in(source, reference).joints)
    noted = source.noted("rectify", method=method, camera=camera, level_heading=levelled.heading, **said)
    unit_ = source.frame.unit
    root = source.root
    if root is not None:
        root = rotate(transpose(R_source_from_level), root) if R_source_from_level.ndim == 2 else None
    body, level = (
        noted.mapped(partial(_canonical, R), frame=frame.with_(unit=unit_), root=place)
        for R, frame, place in ((R_source_from_body, BODY, None), (R_source_from_level, LEVEL, root))
    )
    return Rectified(
        body=body,
        level=level,
        R_source_from_body=R_source_from_body,
        R_source_from_level=R_source_from_level,
        error_deg=levelled.error_deg,
        method=method,
        level_heading=levelled.heading,
        level_ok=not reason,
        level_reason=reason,
        camera="gravity" if reference is Z_UP else camera,
        up_error_deg=levelled.up_error_deg,
        up_bound_deg=levelled.up_bound_deg,
        up_votes=rotate(R_source_from_reference, levelled.votes),
        up_shares=levelled.shares,
        up_pulls=levelled.pulls,
        up_own={name: (R_source_from_reference @ up, error) for name, (up, error) in levelled.own.items()},
    )


def _looks(view: View | None, source: PoseSequence) -> list[tuple[float, Look]]:
    """What the images of a moving camera say, each with its time in the take."""
    looks = view.looks if view else ()
    return [(float(np.interp(look.frame, source.frame_index, _times(source))), look) for look in looks]


def _told(
    gravity: tuple[float, float, float] | None, pitch_deg: float | None, roll_deg: float | None
) -> list[Evidence]:
    """What the user says about the camera, as evidence on up."""
    if gravity is not None and (pitch_deg is not None or roll_deg is not None):
        raise InputError("Expected the camera's gravity, or its pitch and roll, not both.")
    if gravity is not None:
        falls = np.array(gravity, dtype=np.float64)
        if not np.isfinite(falls).all() or not np.linalg.norm(falls) > 0:
            raise InputError(
                f"Expected a direction for gravity, such as 0,1,0 (down the picture), got {gravity}."
            )
        return [direction("gravity vector", -falls, _KNOWN_DEG)]
    if pitch_deg is None and roll_deg is None:
        return []
    angles = [np.array(angle or 0.0) for angle in (0.0, pitch_deg, roll_deg)]
    if not all(np.abs(angle) <= 180 for angle in angles):
        raise InputError(f"Expected pitch and roll in degrees, got {pitch_deg} and {roll_deg}.")
    return [direction("camera pitch and roll", view_rotation(*angles)[:, 2], _KNOWN_DEG)]


def _in(source: PoseSequence, reference: Frame) -> PoseSequence:
    return change_frame(source, reference.with_(origin="pelvis", unit=source.frame.unit))


def _own_gravity(joints: np.ndarray, times: np.ndarray, together: bool) -> Levelled:
    """Of joints in axes whose +z is up: nothing votes. together: LEVEL's heading is the world's, not the person's."""
    up = np.array([0.0, 0.0, 1.0])
    R = R_world_from_body(joints)
    R_level, heading = (np.eye(3), "world") if together else level_frame(R, up, times)
    exact, unknown = np.zeros(len(joints)), np.full(len(joints), np.nan)
    votes = np.full((len(joints), 3), np.nan)
    shares = {"the source's own axes": 1.0}
    return Levelled(R, R_level, unknown, exact, exact, votes, shares, heading, float("nan"), None)


def _drift_event(levelled: Levelled, poses: PoseSequence) -> list[Event]:
    if levelled.drift_at is None:
        return []
    frame = int(poses.frame_index[levelled.drift_at])
    return [
        Event(
            "warning",
            f"The camera was taken for one that stands still, but the frames' ups before and after frame {frame} are "
            f"{levelled.drift_deg:.0f} degrees apart: a cut, a moving camera (--camera moving), or a body that lies or "
            "bends down for long.",
            levelled.drift_at,
        )
    ]


def _apart_event(apart_deg: float) -> list[Event]:
    if np.isnan(apart_deg):
        return []
    return [
        Event(
            "warning",
            f"This person's own up is {apart_deg:.0f} degrees from the one that all of the recording share: they "
            "lean, bend down or lie for long, or the lifter tilted them.",
        )
    ]


def _canonical(R_source_from_canonical: np.ndarray, points: np.ndarray) -> np.ndarray:
    return rotate(transpose(R_source_from_canonical), points.astype(np.float64))
