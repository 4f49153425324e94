"""Rectification: from the camera's axes to the canonical frames BODY and LEVEL (design.md section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..models import load_rectifier
from ..pipeline.canonical import R_world_from_body
from ..pipeline.errors import InputError
from ..pipeline.frames import BODY, CAMERA, LEVEL, Z_UP, change_frame
from ..pipeline.layouts import H36M17
from ..pipeline.pose import PoseSequence, Rectified
from ..pipeline.rotations import angle_deg, from_columns, known, rotate, transpose, unit
from ..pipeline.sockets import Rectifier
from ..pipeline.take import Event, Take

_REFERENCE = {"camera": CAMERA, "world": Z_UP}  # axes in which rotations are estimated
_TURNING = 0.5  # mean resultant of the headings below which a take has no middle heading (design.md)
_FEWEST_FRAMES = 10
_FROM_PICTURE_DEG = 60.0  # a take's up further from the picture's up than this is not believed
_SCATTER_DEG = 35.0  # median deviation of the frames' up from the take's up beyond which no up is stated


@dataclass(frozen=True)
class Rectify:
    """The stage. rectifier: "geometric", "pcnet", or a trained network's .onnx file."""

    rectifier: str = "pcnet"

    name: ClassVar[str] = "rectify"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("rectified",)

    def __call__(self, take: Take) -> Take:
        assert take.poses is not None
        rectified = rectify(take.poses, self.rectifier)
        events = []
        lost = int(np.isnan(rectified.R_source_from_body).any(axis=(1, 2)).sum())
        if lost:
            events.append(
                Event("warning", f"{lost} of {len(take.poses)} frames have too few torso joints to rectify.")
            )
        if not rectified.level_ok:
            events.append(Event("warning", f"The take could not be levelled: {rectified.level_reason}."))
        return take.with_(rectified=rectified).saying(*events)


def rectify(poses: PoseSequence, rectifier: str | Rectifier = "pcnet") -> Rectified:
    """Turn a skeleton into BODY, upright and facing -X in every frame, and LEVEL, one upright frame a take.

    poses: H36M17 in the axes of a camera, or of a world frame whose gravity is known: then nothing is estimated
    but the heading. The joints are taken relative to the pelvis; NaN stays NaN. "source" in the rotations' names
    are the axes that the poses come in. A frame with too few torso joints has a NaN rotation. A take that cannot
    be levelled has level_ok False and a reason, and never raises. InputError for another layout or frame.
    """
    if poses.layout != H36M17:
        raise InputError(f"rectify needs joints in layout H36M17, got {poses.layout.name}; use remap first.")
    if poses.frame.family not in _REFERENCE or not poses.frame.right_handed:
        raise InputError(
            f"rectify needs joints in right-handed axes of a camera or a world, got {poses.frame}."
        )
    source = change_frame(poses, poses.frame.with_(origin="pelvis"))
    reference = _REFERENCE[source.frame.family]
    joints = change_frame(source, reference.with_(origin="pelvis", unit=source.frame.unit)).joints
    if reference is Z_UP:
        method, error_deg = "gravity", np.full(len(source), np.nan)
        R_reference_from_body = R_world_from_body(joints)
    else:
        chosen = load_rectifier(rectifier) if isinstance(rectifier, str) else rectifier
        method = chosen.method
        R_reference_from_body, error_deg = chosen.rotation(joints)
    R_source_from_body = source.frame.basis @ reference.basis.T @ R_reference_from_body
    picture_up = source.frame.basis @ np.array([0.0, -1.0, 0.0]) if reference is CAMERA else None
    R_source_from_level, heading, reason = level(R_source_from_body, source.time_s, picture_up)
    noted = source.noted("rectify", method=method, level_heading=heading)
    unit_ = source.frame.unit
    return Rectified(
        body=noted.with_(joints=_canonical(R_source_from_body, source), frame=BODY.with_(unit=unit_)),
        level=noted.with_(joints=_canonical(R_source_from_level, source), frame=LEVEL.with_(unit=unit_)),
        R_source_from_body=R_source_from_body,
        R_source_from_level=R_source_from_level,
        error_deg=error_deg,
        method=method,
        level_heading=heading,
        level_ok=not reason,
        level_reason=reason,
    )


def _canonical(R_source_from_canonical: np.ndarray, poses: PoseSequence) -> np.ndarray:
    return rotate(transpose(R_source_from_canonical), poses.joints.astype(np.float64))


def level(
    R_source_from_body: np.ndarray, time_s: np.ndarray | None, picture_up: np.ndarray | None = None
) -> tuple[np.ndarray, str, str]:
    """One upright frame for a take of a camera that stands still.

    R_source_from_body: (T, 3, 3), NaN where unknown. time_s: (T,) or None. picture_up: (3,) the picture's upward
    direction in the source's axes; people film with it near the vertical.
    Returns R_source_from_level (3, 3), how its heading was chosen ("median", or "first second" for a person
    who turns around), and in words why the take could not be levelled, or "".
    """
    trusted = known(R_source_from_body).all(axis=1)
    if not trusted.any():
        return np.full((3, 3), np.nan), "none", "no frame has the torso joints that a rotation needs"
    ups = R_source_from_body[trusted, :, 2]
    up = unit(ups.mean(axis=0))
    scatter = float(np.median(angle_deg(ups, up)))
    reason = ""
    if trusted.sum() < _FEWEST_FRAMES:
        reason = f"only {trusted.sum()} frames have a rotation"
    elif picture_up is not None and angle_deg(up, picture_up) > _FROM_PICTURE_DEG:
        reason = (
            f"its up is {angle_deg(up, picture_up):.0f} degrees from the picture's: the person lies or hangs, or the "
            "camera is turned"
        )
    elif not scatter < _SCATTER_DEG:
        reason = f"the frames' up directions scatter by {scatter:.0f} degrees about their mean"
    # Headings as complex numbers in the horizontal plane, measured from any fixed direction in it.
    side = unit(np.cross(up, np.eye(3)[np.argmin(np.abs(up))]))
    facing = -R_source_from_body[trusted, :, 0]
    heading = facing @ side + 1j * (facing @ np.cross(up, side))
    heading = heading / np.maximum(np.abs(heading), 1e-12)
    how = "median"
    if np.abs(heading.mean()) < _TURNING:
        how = "first second"
        times = np.arange(len(R_source_from_body)) / 30 if time_s is None else time_s
        since = times[trusted] - times[trusted][0]
        heading = heading[since <= 1.0]
    angle = _circular_median(heading)
    front = np.cos(angle) * side + np.sin(angle) * np.cross(up, side)
    back = -front
    return from_columns(back, np.cross(up, back), up), how, reason


def _circular_median(directions: np.ndarray) -> float:
    """Angle in radians of the circular median of unit complex numbers that share a half circle."""
    centre = np.angle(directions.mean())
    return float(centre + np.median(np.angle(directions * np.exp(-1j * centre))))
