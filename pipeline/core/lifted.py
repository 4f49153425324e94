"""What a lifter is given, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from .errors import InputError
from .frames import CAMERA
from .intrinsics import Intrinsics
from .layouts import H36M17
from .pose import MadeBy, PoseSequence
from .take import Video


@dataclass(frozen=True, eq=False)
class ToLift:
    """What a lifter is given.

    keypoints: of one person, in IMAGE, pixels, in the detector's layout; missing joints NaN. image_size: width and
        height in pixels as the video is shown, None where unknown.
    focal_px: focal length in pixels, None when unknown. focal_guessed: that it is only what phones usually have.
    video: the one that the frame numbers are of.
    intrinsics: those of a calibrated camera. The keypoints are then free of the lens's distortion, except for a lifter
        that looks at the images.
    up: (3,) unit vector in CAMERA, or (T, 3) for a moving camera, if up is known within a few degrees; NaN in frames
        where it is not, None if it is unknown.
    """

    keypoints: PoseSequence
    image_size: tuple[int, int] | None = None
    focal_px: float | None = None
    video: Video | None = None
    intrinsics: Intrinsics | None = None
    up: np.ndarray | None = None
    focal_guessed: bool = False

    @property
    def focal_known(self) -> bool:
        """Whether somebody or something tells the focal length of this camera."""
        return self.focal_px is not None and not self.focal_guessed


@dataclass(frozen=True, eq=False)
class Lifted:
    """What a lifter answers.

    poses: the keypoints' rows as H36M17 in CAMERA axes relative to the pelvis; `root` where the lifter itself places
        the pelvis, without an error.
    model: how results name the lifter, "name@<hash>". kind: of network, in a word.
    focal_px: the focal length in pixels that the poses rest on, given or assumed by the lifter; None if they rest on
        none. focal_known: ToLift.focal_known.
    up_known: whether the poses rest on the given up; None for a lifter that takes none.
    frames_without_joints: too far from any keypoint to be lifted. joints_on_a_line: missing keypoints, put on a line
        between where they were seen. None for what the lifter does not count.

    Raises InputError for other layouts or frames of poses.
    """

    poses: PoseSequence
    model: str
    kind: str
    focal_px: float | None
    focal_known: bool
    up_known: bool | None = None
    frames_without_joints: int | None = None
    joints_on_a_line: int | None = None

    def __post_init__(self) -> None:
        layout, frame = self.poses.layout, self.poses.frame
        where = (CAMERA.family, CAMERA.axes, "pelvis")
        if not layout.is_body or (frame.family, frame.axes, frame.origin) != where:
            raise InputError(
                "plugin-broken",
                f"Expected the lifter {self.model} to return poses of {H36M17.name} in {CAMERA.name} axes relative "
                f"to the pelvis, got {layout.name} in {frame}: repair its package.",
            )

    @property
    def placed(self) -> bool:
        """Whether the lifter itself says where the pelvis is."""
        return self.poses.root is not None

    def noted(self) -> PoseSequence:
        """The poses, by this lifter, whose history ends with the step "lift" and all of this, for readers."""
        values: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(self)[1:]}
        if self.focal_px is not None:
            values["focal_px"] = round(float(self.focal_px), 1)
        poses = self.poses.with_(made_by=MadeBy("estimated", self.model))
        return poses.noted("lift", **{name: value for name, value in values.items() if value is not None})
