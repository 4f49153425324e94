"""A take: one recording of one person, and everything that is known or was computed about it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, overload

import numpy as np

from .camera import Camera
from .errors import InputError
from .pose import PoseSequence, Rectified
from .verdict import Finding


@dataclass(frozen=True, eq=False)
class Video:
    """A video file, described without decoding it.

    width, height: pixels as stored, before `rotation_deg` (0, 90, 180, 270; clockwise) is applied.
    time_s: (N,) time stamp of every frame in display order, from the first frame's 0.
    codec: name as FFmpeg writes it, such as "h264" or "mpeg4". focal_px: the focal length that the file states, about.
    capture_fps: frames a second of the camera, where the file states it: more than are shown is slow motion.
    part: the first and the last frame that the take is about; None for all. doubts: sentences about a file that seems
    not to be whole.
    """

    path: Path
    width: int
    height: int
    time_s: np.ndarray
    codec: str
    rotation_deg: int = 0
    focal_px: float | None = None
    capture_fps: float | None = None
    part: tuple[int, int] | None = None
    doubts: tuple[str, ...] = ()

    @property
    def span(self) -> tuple[int, int]:
        """The first and the last frame that the take is about."""
        return self.part or (0, len(self.time_s) - 1)

    @property
    def span_bytes(self) -> int:
        """About how many bytes of the file hold these frames."""
        first, last = self.span
        return self.path.stat().st_size * (last + 1 - first) // len(self.time_s)

    @property
    def fps(self) -> float:
        """Frames per second on average."""
        frames = len(self.time_s) - 1
        return frames / float(self.time_s[-1] - self.time_s[0]) if frames else float("nan")


@dataclass(frozen=True)
class Event:
    """Something that happened at a row of the poses, or a warning about the whole take (row None).

    kind: "warning", "repair", "seam", "note". about: what a warning or repair is about, where the report's gauge of
    trust has a place for it.
    """

    kind: str
    text: str
    row: int | None = None
    about: Literal["", "left and right", "view"] = ""


@dataclass(frozen=True)
class Session:
    """What the user says about a recording; empty where nothing was said. date: YYYY-MM-DD."""

    title: str = ""
    person_id: str = ""
    date: str = ""


@dataclass(frozen=True, eq=False)
class Take:
    """One recording of one person. Stages fill it in; a field nobody has filled is None.

    keypoints: 2D joints in IMAGE, in the detector's own layout.
    camera: what the image and the user say about the camera.
    poses: 3D joints, H36M17 in CAMERA axes, relative to the pelvis.
    findings: what `pcnet3d inspect` finds in the poses as they were read or lifted (pipeline/verdict.py).
    filtered: 3D joints in LEVEL after the low-pass filter that kinematics rest on; its history says which.
    kinematics: columns (T,) by name, whose ends tell the units (design.md section 7).
    measures: figures of the take as nested plain dicts, units in the keys.
    second_lift: how far another lifter of the same keypoints is from the poses, as nested plain dicts, units in the
        keys (stages/second_lift.py).
    session: what the user says about the recording: title, person, date.
    inputs: what was read: role, path, SHA-256, adapter.
    """

    name: str
    video: Video | None = None
    keypoints: PoseSequence | None = None
    camera: Camera | None = None
    poses: PoseSequence | None = None
    findings: tuple[Finding, ...] | None = None
    rectified: Rectified | None = None
    filtered: PoseSequence | None = None
    kinematics: dict[str, np.ndarray] | None = None
    measures: dict[str, Any] | None = None
    second_lift: dict[str, Any] | None = None
    events: tuple[Event, ...] = ()
    inputs: tuple[dict[str, Any], ...] = ()
    session: Session = Session()

    @property
    def title(self) -> str:
        """The session's title; without one the take's name."""
        return self.session.title or self.name

    def with_(self, **changes: Any) -> Take:
        return replace(self, **changes)

    @overload
    def need(self, what: Literal["poses", "keypoints", "filtered"]) -> PoseSequence: ...
    @overload
    def need(self, what: Literal["rectified"]) -> Rectified: ...
    @overload
    def need(self, what: Literal["kinematics"]) -> dict[str, np.ndarray]: ...
    @overload
    def need(self, what: Literal["video"]) -> Video: ...
    @overload
    def need(self, what: Literal["camera"]) -> Camera: ...
    def need(self, what: str) -> Any:
        """A field that has to be filled; InputError naming it where no stage has given it yet."""
        value = getattr(self, what)
        if value is None:
            raise InputError(
                f"Expected a take with {what}, got one without; run the stage that gives {what} first."
            )
        return value

    def saying(self, *events: Event) -> Take:
        """A copy with these events added."""
        return replace(self, events=(*self.events, *events))
