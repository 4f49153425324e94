"""A second lift of the same keypoints by another network: where the two disagree, at least one of them errs."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from ..models.common.metrics import Figure, person_size
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA, change_frame
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.pose import PoseSequence, Rectified
from ..pipeline.core.rotations import is_finite, rotate, transpose
from ..pipeline.core.take import Event, Take
from ..pipeline.signals.angles import ANGLES, angles, near
from .lift import Lift

# Mean distance of the joints, in per cent of the person's size, from which a run warns. On the two clips of
# docs/lifting.md, section "Two lifters of one video", half of all frames lie below 20, and above 30 are the frames in
# which one lifter was seen to have limbs exchanged or the body back to front.
WARNED = 30.0
_PAUSE_S = 0.2  # between two stretches that are named as one
_LISTED = 5


@dataclass(frozen=True)
class SecondLift:
    """The stage, between the angles and what is made of them. Options as those of `Lift`, of the second lifter, whose
    handedness is not questioned."""

    lifter: str = "pcnet3d"
    lifter_kind: str | None = None
    flip: bool = False
    _lift: Lift = field(init=False, repr=False, compare=False)

    name: ClassVar[str] = "second_lift"
    needs: ClassVar[tuple[str, ...]] = ("keypoints", "poses", "rectified")
    gives: ClassVar[tuple[str, ...]] = ("second_lift", "kinematics")
    reads: ClassVar[tuple[str, ...]] = Lift.reads

    def __post_init__(self) -> None:
        """Opens the lifter, as `Lift` does."""
        told = {each.name: getattr(self, each.name) for each in fields(self) if each.init}
        object.__setattr__(self, "_lift", Lift(**told, handedness="ignore"))

    def __call__(self, take: Take) -> Take:
        poses = take.need("poses")
        if poses.frame.family != "camera":
            raise InputError(
                f"Expected poses in a camera's axes to compare a second lift with, got {poses.frame}; leave "
                "--also-lifter out."
            )
        second = self._lift(take).need("poses")
        column, found = disagreement(poses, second, take.need("rectified"))
        # A doubt about left and right comes behind it.
        lifted = next(step for step in reversed(second.history) if step.name == "lift")
        found = {"lifter": lifted.options["model"], **found}
        columns = {**(take.kinematics or {}), "lifters_apart_percent": column}
        return take.with_(kinematics=columns, second_lift=found).saying(*_warnings(found, column))


def disagreement(
    poses: PoseSequence, second: PoseSequence, rectified: Rectified
) -> tuple[np.ndarray, dict[str, Any]]:
    """How far two lifts of one person are apart, both in the camera's axes about the pelvis, the second at the size of
    the first by one factor for the take; angles to gravity and trunk angles of both by the first one's rectification.

    poses, second: H36M17 in axes of the camera; rows are matched by `frame_index`. -> (T,) the mean distance of the
    joints that both have at times, in per cent of the person's size (the root mean square distance of the joints from
    the pelvis), NaN where either lacks one of them; and figures with the unit in their names: of the distance of all
    joints and of each, of the difference of each angle (second less first) its mean, root mean square and 95th
    percentile, and `spans_s`, when the column is above WARNED.
    """
    source = change_frame(poses, CAMERA.with_(origin="pelvis", unit=poses.frame.unit))
    a = source.joints.astype(np.float64)
    b = np.full(a.shape, np.nan)
    _, rows, others = np.intersect1d(source.frame_index, second.frame_index, return_indices=True)
    b[rows] = second.joints[others]
    both = np.asarray(is_finite(a) & is_finite(b))
    a, b = (np.where(both[..., None], each, np.nan) for each in (a, b))
    moving = [i for i, joint in enumerate(H36M17.joints) if joint != "pelvis"]
    size = person_size(a)
    b *= size / person_size(b)
    apart = 100 * np.linalg.norm(a - b, axis=-1) / size
    column = apart[:, [i for i in moving if both[:, i].any()]]
    column = column.mean(axis=1) if column.size else np.full(len(apart), np.nan)
    return column, {
        "frames": int(np.isfinite(column).sum()),
        "apart_percent": Figure.of(column),
        "joints": {H36M17.joints[i]: {"apart_percent": Figure.of(apart[:, i])} for i in moving},
        "angles": _angles(a, b, poses, rectified),
        "spans_s": [
            [float(source.times[start]), float(source.times[stop])]
            for start, stop in _spans(column > WARNED, source.times)
        ],
    }


def _angles(
    a: np.ndarray, b: np.ndarray, poses: PoseSequence, rectified: Rectified
) -> dict[str, dict[str, float]]:
    R = CAMERA.basis @ poses.frame.basis.T @ rectified.R_source_from_body
    first, second = (angles(rotate(transpose(R), joints)) for joints in (a, b))
    found = {}
    for name, angle in ANGLES.items():
        off = near(second[name] - first[name], 0.0)
        off = off[np.isfinite(off)]
        if len(off) and (rectified.level_ok or not angle.needs_gravity):
            found[name] = {
                "mean_deg": float(off.mean()),
                "rms_deg": float(np.sqrt((off**2).mean())),
                "p95_deg": float(np.quantile(np.abs(off), 0.95)),
            }
    return found


def _spans(wide: np.ndarray, time_s: np.ndarray) -> list[tuple[int, int]]:
    """The first and the last row of each stretch of rows (T,) that are true, pauses of up to _PAUSE_S included."""
    found: list[tuple[int, int]] = []
    for row in np.flatnonzero(wide):
        if found and time_s[row] - time_s[found[-1][1]] <= _PAUSE_S:
            found[-1] = (found[-1][0], int(row))
        else:
            found.append((int(row), int(row)))
    return found


def _warnings(found: dict[str, Any], apart: np.ndarray) -> list[Event]:
    if not found["frames"]:
        text = f"The second lifter, {found['lifter']}, has no frame in common with the poses."
        return [Event("warning", text)]
    if not found["spans_s"]:
        return []
    times = [
        f"{start:.2f}" if start == stop else f"{start:.2f} to {stop:.2f}"
        for start, stop in found["spans_s"][:_LISTED]
    ]
    more = len(found["spans_s"]) - _LISTED
    text = (
        f"The second lifter, {found['lifter']}, disagrees with the poses at {', '.join(times)} s"
        f"{f' and {more} more times' if more > 0 else ''}: the joints are up to {np.nanmax(apart):.0f} % of the "
        "person's size apart on average, so there one of the two errs by half of that or more; look at the video."
    )
    return [Event("warning", text, int(np.flatnonzero(apart > WARNED)[0]))]
