"""Poses and keypoints given in memory: arrays, whose meaning is said beside them, or what `read` gives."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.errors import InputError
from ..core.frames import CAMERA, GL_CAMERA, IMAGE, Y_UP, Z_UP, Frame
from ..core.layouts import H36M17, LAYOUTS, Layout, layout_named, layouts_of
from ..core.messages import how_many
from ..core.pose import UNSAID, MadeBy, PoseSequence
from ..core.rotations import is_finite
from ..core.take import SILENT, Told
from .bounds import timed
from .findings import guarded
from .joint_order import check_order, likely_layout
from .load import Source

AXES = {"camera": CAMERA, "camera-y-up": GL_CAMERA, "z-up": Z_UP, "y-up": Y_UP}
UNIT = "arbitrary"


@dataclass(frozen=True)
class Meaning:
    """What an array of 3D joints holds. axes: a name of AXES, joints: a layout or its name, unit: a unit of frames;
    None for the usual: CAMERA, Human3.6M's joints, no known scale."""

    axes: str | None = None
    joints: Layout | str | None = None
    unit: str | None = None

    @property
    def frame(self) -> Frame:
        """InputError for other names."""
        name = "camera" if self.axes is None else self.axes
        if name not in AXES:
            raise InputError("bad-value", f"Expected axes of {', '.join(AXES)}; got '{name}'.")
        frame = AXES[name]
        origin = "camera" if frame.family == "camera" else frame.origin
        return frame.with_(origin=origin, unit=self.unit or UNIT)

    @property
    def layout(self) -> Layout:
        """InputError for another name."""
        return H36M17 if self.joints is None else layout_named(self.joints)

    def refuse(self) -> None:
        """InputError where something is said: of poses that say it themselves."""
        given = [name for name, value in vars(self).items() if value is not None]
        if given:
            raise InputError(
                "option-conflict",
                f"{', '.join(given)}: expected this of an array, got it of poses that say it themselves; leave it out.",
            )


def poses_given(values: Any, meaning: Meaning, fps: float | None = None, told: Told = SILENT) -> PoseSequence:
    """One person's 3D poses, as `read` gives them.

    values: joints (T, J, 3) or, of one frame, (J, 3), of which NaN and frames of zeros are missing; or poses that are
    read already, which are looked at once more. InputError for another shape, for joints in another order, and for
    what is wrong in a file, too.
    """
    if isinstance(values, PoseSequence):
        meaning.refuse()
        poses = values if fps is None else timed(values, fps)
        whole = poses.layout.is_body and poses.frame.dims == 3
        return guarded(poses, told.handedness, "The poses", told.check) if whole else poses
    source = source_of("poses", values, meaning, told)
    if len(source.people) != 1:
        raise InputError(
            "choose-person", f"Expected one person's poses, got {len(source.people)} people's; give one."
        )
    return source.normalised(source.people[0], fps, told)


def source_of(
    role: Literal["poses", "keypoints"], given: Any, meaning: Meaning, told: Told = SILENT
) -> Source:
    """In-memory poses or keypoints of everybody as those of a file: what `read` or `read_all` gives, or an array of one
    person.

    poses: as of `poses_given`. keypoints: (T, K, 2) or, with scores, (T, K, 3), in pixels of the image, of whose
    meaning only the joints count: None for the usual ones of so many. InputError for another shape, another order of
    joints, nobody, and the one in place of the other.
    """
    people = [given] if isinstance(given, PoseSequence) else given
    if isinstance(people, Sequence) and people and all(isinstance(each, PoseSequence) for each in people):
        meaning.refuse()
        if any((person.frame.family == "image") != (role == "keypoints") for person in people):
            raise InputError(
                "wrong-content",
                f"Expected {role}, got others; give 3D poses as poses, 2D keypoints as keypoints.",
            )
    else:
        people = [_poses(given, meaning, told) if role == "poses" else _keypoints(given, meaning.joints)]
    digest = hashlib.sha256(b"".join(person.joints.tobytes() for person in people)).hexdigest()
    return Source(Path(f"{role} in memory"), "memory", tuple(people), f"The {role} in memory", digest)


def _keypoints(given: Any, joints: Layout | str | None) -> PoseSequence:
    """An array in the layout that it is said to have, as an adapter gives keypoints."""
    where = "The array of keypoints"
    points = numbers(given, "the array of keypoints")
    if points.ndim != 3 or points.shape[2] not in (2, 3) or not points.size:
        raise InputError(
            "wrong-content",
            f"{where}: expected the shape (frames, joints, 2), or with scores (frames, joints, 3), got {points.shape}; "
            "give one person.",
        )
    xy = points[..., :2]
    scores = points[..., 2] if points.shape[2] == 3 else np.full(points.shape[:2], np.nan)
    xy = np.where(((xy == 0).all(axis=-1) | ~is_finite(xy))[..., None], np.nan, xy)
    if np.isnan(xy).all():
        raise InputError("nothing-usable", f"{where}: there is no joint in it, only NaN or 0, 0.")
    layout = layout_in_2d(xy.shape[1], joints, where)
    if joints is None:
        layout = likely_layout(xy, layouts_of(xy.shape[1], where))
        check_order(xy[:, : len(layout)], layout, f"{where}: ", 'keypoint_joints="{}"')
    xy, scores = xy[:, : len(layout)], np.clip(scores[:, : len(layout)], 0, 1)
    rows = np.flatnonzero(np.isfinite(xy).any(axis=(1, 2)))
    numbered: dict[str, Any] = {} if len(rows) == len(xy) else {"frame_index": rows}
    return PoseSequence(xy[rows], layout, IMAGE, scores[rows], **numbered)


def layout_in_2d(count: int, joints: Layout | str | None, where: str) -> Layout:
    """The layout that is said, or the usual one of so many joints. InputError where it has another number."""
    if joints is None:
        return layouts_of(count, where)[0]
    layout = layout_named(joints)
    if len(layout) != count:
        raise InputError(
            "wrong-content",
            f"{where}: expected {how_many(len(layout), 'joint')}, as {layout.name} has, got {count}.",
        )
    return layout


def _poses(values: Any, meaning: Meaning, told: Told) -> PoseSequence:
    """An array in the layout and frame that it is said to have, as an adapter gives poses."""
    where, layout, frame = "The array of poses", meaning.layout, meaning.frame
    joints = numbers(values, "poses")
    shape = joints.shape
    if joints.ndim == 4 and 1 in shape[:2]:  # a batch of one, or one person
        joints = joints.reshape(-1, *shape[2:])
    joints = joints[None] if joints.ndim == 2 else joints
    if joints.shape[1:] != (len(layout), 3) or not joints.size:
        fits = [name for name, other in LAYOUTS.items() if joints.shape[1:] == (len(other), 3)]
        hint = f"; of so many joints are {', '.join(fits)}: say which with joints=" if fits else ""
        raise InputError(
            "wrong-content",
            f"{where}: expected the shape (frames, {len(layout)}, 3) of joints={layout.name}, got {shape}{hint}.",
        )
    if told.check == "refuse":
        check_order(joints, layout, f"{where}: ", 'joints="{}"')
    made_by = MadeBy("estimated") if frame.family == "camera" else UNSAID
    return PoseSequence(joints, layout, frame, made_by=made_by)


def numbers(values: Any, what: str) -> np.ndarray:
    """The values (...,) as float32 or, if they are finer, float64: an array, nested lists, or a torch tensor, from
    whichever device. what: they are, for the error. InputError for anything but numbers, and for infinite ones."""
    if hasattr(values, "detach"):  # a torch tensor
        values = values.detach().cpu()
        values = (values.float() if "bfloat16" in str(values.dtype) else values).numpy()
    try:
        array = np.asarray(values)
    except (TypeError, ValueError) as error:
        raise InputError("wrong-content", f"Expected {what} as an array of numbers: {error}.") from None
    if array.dtype.kind not in "fiu":
        raise InputError("wrong-content", f"Expected {what} as an array of numbers, got {array.dtype}.")
    array = array.astype(np.result_type(np.float32, array.dtype), copy=False)
    if np.isinf(array).any():
        raise InputError("wrong-content", f"Expected {what} as finite numbers or NaN, got infinite ones.")
    return array
