"""A take: one recording of one person, and everything that is known or was computed about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, overload

import numpy as np

from .anthropometry import STATURES_M
from .camera import Camera
from .errors import InputError, needed_for
from .measures import Measures
from .messages import in_one_line
from .notices import Notice, grave, verdict, without_doubles
from .pose import PoseSequence, Rectified, Step

if TYPE_CHECKING:
    import pandas
    import xarray

CameraMotion = Literal["static", "moving"]
Handedness = Literal["refuse", "mirror", "swap", "swap-legs", "ignore"]
Check = Literal["refuse", "off"]
AngleErrors = Literal["judged", "disagreement", "file", "none"]


@dataclass(frozen=True, eq=False)
class Video:
    """A video file, described without decoding it.

    width, height: pixels as stored, before `rotation_deg` (0, 90, 180, 270; clockwise) is applied.
    time_s: (N,) time stamp of every frame in display order, from the first frame's 0.
    codec: name as FFmpeg writes it, such as "h264" or "mpeg4". focal_px: the focal length that the file states, about.
    capture_fps: frames a second of the camera, where the file states it: more than are shown is slow motion.
    part: the first and the last frame that the take is about; None for all. doubts: about a file that seems not to be
    whole, or not fit. key_frames: numbers of those that are decoded without the ones before.
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
    doubts: tuple[Notice, ...] = ()
    key_frames: tuple[int, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the images as they are shown, the rotation obeyed."""
        return (self.height, self.width) if self.rotation_deg in (90, 270) else (self.width, self.height)

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
class Told:
    """What the user says about a recording; None where nothing was said. Stages read it here and nowhere else, so that
    they cannot contradict each other.

    camera: "static" if it stands still during the take, "moving" if it pans or is carried. focal_px: its
    focal length. gravity: which way things fall, in the camera's axes (x right, y down, z away), any length. pitch_deg,
    roll_deg: of the camera, positive when it looks down, and when the image's content turns counter-clockwise; give
    both or neither, because a missing angle is not 0. image_size: width and height in pixels, of a take without a
    video. stature_m: the person's height.
    images: False keeps every image of the person out of the results. fps: frames a second, instead of the file's.
    person: which of several people, by name, or "longest" or "largest". handedness: what to do if left and right of the
    poses are exchanged. check: "off" takes poses that are mirrored or upside down as they are.

    InputError for values that cannot be, before a run looks at the whole video.
    """

    camera: CameraMotion | None = None
    focal_px: float | None = None
    gravity: tuple[float, float, float] | None = None
    pitch_deg: float | None = None
    roll_deg: float | None = None
    image_size: tuple[int, int] | None = None
    stature_m: float | None = None
    images: bool = True
    fps: float | None = None
    person: str | None = None
    handedness: Handedness = "refuse"
    check: Check = "refuse"

    def __post_init__(self) -> None:
        pitch, roll = self.pitch_deg, self.roll_deg
        angles = [angle for angle in (pitch, roll) if angle is not None]
        choices = {"camera": CameraMotion, "handedness": Handedness, "check": Check}
        for name, allowed in choices.items():
            if (value := getattr(self, name)) not in (getattr(Told, name), *get_args(allowed)):
                expected = ", ".join(get_args(allowed))
                raise InputError("bad-value", f"Expected {name} to be one of {expected}; got '{value}'.")
        direction = None if self.gravity is None else float(np.linalg.norm(self.gravity))
        figures = (
            ("gravity", direction, 0, np.inf, "a direction for gravity, such as 0,1,0 (down in the image)"),
            ("focal_px", self.focal_px, 0, np.inf, "a focal length of more than 0 pixels (--focal)"),
            ("stature_m", self.stature_m, *STATURES_M,
             "a stature between {} and {} metres (--stature)".format(*STATURES_M)),
            ("image_size", min(self.image_size or (2,)), 1, np.inf,
             "sides of an image of 2 pixels or more (--set read.image_size)"),
        )  # fmt: skip
        for name, figure, least, most, what in figures:
            if figure is not None and not least < figure < most:
                got = getattr(self, name)
                raise InputError("bad-value", f"Expected {what}, got {got}; leave it out if it is not known.")
        if bool(angles) + (direction is not None) + self.moving > 1:
            raise InputError(
                "option-conflict",
                "Expected the camera's gravity, or its pitch and roll, not both, and neither of them for a moving "
                "camera; leave one out.",
            )
        if not all(abs(angle) <= 180 for angle in angles):
            raise InputError("bad-value", f"Expected pitch and roll in degrees, got {pitch} and {roll}.")
        if len(angles) == 1:
            alone = "roll" if pitch is None else "pitch"
            raise InputError(
                "needs-input",
                f"Expected the camera's pitch and roll together, got only the {alone}; a camera that looks neither "
                "up nor down has a pitch of 0, a camera that shows the horizon level has a roll of 0.",
            )

    @property
    def moving(self) -> bool:
        """Whether a camera is told that moves."""
        return self.camera == "moving"

    @property
    def standing(self) -> bool:
        """Whether a camera is told that stands still, by itself or by how it looks."""
        return self.camera == "static" or self.gravity is not None or self.pitch_deg is not None


SILENT = Told()


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
    findings: what `pcnet3d inspect` finds in the poses as they were read or lifted; None where nothing looked.
    filtered: 3D joints in LEVEL after the low-pass filter that kinematics rest on. Their covariance, if the lifter
        states one, is that of the whole error except up's.
    cutoff_hz: cut-off of that filter; None without one.
    kinematics: columns (T,) by name; the end of a name tells the unit (design.md section 7). Our stages use single
        precision (`in_single`), because these columns take most of a long take's memory.
    angle_errors: how the errors of its angles, and of all that rests on angles, are known: "judged" (the built-in
        lifter made the poses), "disagreement" (of another lifter with it), "file" (given by the user), or "none". None
        for a take without angles.
    measures: its figures, remarks, moments and curves (pipeline/core/measures.py).
    session: what the user says about the recording: title, person, date.
    told: what the user says that stages use: camera, up, image size, stature, privacy.
    notices: what else is said of it (pipeline/core/notices.py).
    inputs: what was read: role, path, SHA-256, adapter.
    """

    name: str
    video: Video | None = None
    keypoints: PoseSequence | None = None
    camera: Camera | None = None
    poses: PoseSequence | None = None
    findings: tuple[Notice, ...] | None = None
    rectified: Rectified | None = None
    filtered: PoseSequence | None = None
    cutoff_hz: float | None = None
    kinematics: dict[str, np.ndarray] | None = None
    angle_errors: AngleErrors | None = None
    measures: Measures | None = None
    notices: tuple[Notice, ...] = ()
    inputs: tuple[dict[str, Any], ...] = ()
    session: Session = Session()
    told: Told = SILENT

    def __repr__(self) -> str:
        filled = [each.name for each in fields(self)[1:] if getattr(self, each.name) is not each.default]
        rows = "no poses yet" if self.rows is None else self.rows.in_words
        return in_one_line(f"<Take {self.name}: {rows}; filled: {', '.join(filled) or 'nothing'}>")

    @property
    def title(self) -> str:
        """The session's title; without one the take's name."""
        return self.session.title or self.name

    @property
    def rows(self) -> PoseSequence | None:
        """Its poses, or the keypoints of a take that has no poses yet."""
        return self.keypoints if self.poses is None else self.poses

    @property
    def image_size(self) -> tuple[int, int] | None:
        """Width and height of its images, as its video shows them or as the user tells; None where neither does."""
        return self.told.image_size if self.video is None else self.video.size

    @property
    def moving(self) -> bool:
        """Whether the camera moves, as the user says, else by the background of its images. Without either it counts as
        static."""
        if self.told.moving or self.told.standing or self.camera is None or self.camera.background is None:
            return self.told.moving
        return self.camera.background.moves

    @property
    def stands(self) -> bool:
        """Whether the camera is known to stand still, from the user or from the background of its images."""
        background = None if self.camera is None else self.camera.background
        looks_still = background is not None and background.kind == "still"
        return self.told.standing or (looks_still and not self.told.moving)

    @property
    def figures(self) -> Measures:
        """Its measures; none where no stage has made any."""
        return self.measures or Measures()

    @property
    def judged(self) -> tuple[Notice, ...]:
        """What its poses are judged by: the findings, and graver notices of what they were read with."""
        return without_doubles((*(self.findings or ()), *grave(self.notices)))

    @property
    def verdict(self) -> str | None:
        """Of what its poses are judged by; None where nothing looked at them."""
        return None if self.findings is None else verdict(self.judged)

    @property
    def said(self) -> tuple[Notice, ...]:
        """What makes its poses doubtful, and its other notices, each once."""
        return without_doubles((*grave(self.findings or ()), *self.notices))

    @property
    def error_unknown(self) -> bool:
        """Whether nothing tells how far its poses are off, neither their source nor a lifter's stated errors."""
        return (
            self.angle_errors == "none" and self.poses is not None and self.poses.made_by.kind != "measured"
        )

    @property
    def history(self) -> tuple[Step, ...]:
        """Every step of its rectified poses, oldest first, to the last that kinematics rest on."""
        level = self.need("rectified").level.history
        return (*level, *(() if self.filtered is None else self.filtered.history[len(level) :]))

    def texts(self, weight: str) -> list[str]:
        """The sentences of its notices of that weight."""
        return [each.text for each in self.notices if each.weight == weight]

    def with_(self, **changes: Any) -> Take:
        return replace(self, **changes)

    def telling(self, **told: Any) -> Take:
        """A copy with other values in these fields of `told`."""
        return replace(self, told=replace(self.told, **told))

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
                "needs-stage",
                f"Expected a take with {what}, got one without; run the stage that gives {what} first.",
            )
        return value

    def saying(self, *notices: Notice) -> Take:
        """A copy with these notices added, each once."""
        return replace(self, notices=without_doubles((*self.notices, *notices)))

    def to_pandas(self) -> pandas.DataFrame:
        """A row a frame: `frame`, `time_s` and the columns of its kinematics, as kinematics.parquet has them. Needs
        pandas; InputError without it, and for a take without kinematics."""
        columns, poses = self.need("kinematics"), self.need("poses")
        with needed_for("to_pandas", "xarray"):
            import pandas
        return pandas.DataFrame({"frame": poses.frame_index, "time_s": poses.times, **columns})

    def to_xarray(self) -> xarray.Dataset:
        """The joints in LEVEL, unfiltered, in the layout of the package `movement` (of 0.17, whose
        validators/datasets.py calls dimensions in the singular): `position` (time, space, keypoint, individual) and
        `confidence` (time, keypoint, individual). Needs xarray; InputError without it, without time stamps, and for a
        take that has not been rectified."""
        level = self.need("rectified").level
        coordinates = {
            "time": level.times, "space": list("xyz"), "keypoint": list(level.layout.joints),
            "individual": [level.person],
        }  # fmt: skip
        axes = {"units": level.frame.unit, "axes": str(level.frame)}
        variables = {
            "position": (tuple(coordinates), np.swapaxes(level.joints, 1, 2)[..., None], axes),
            "confidence": (("time", "keypoint", "individual"), level.confidence[..., None], {}),
        }
        whole = {"ds_type": "poses", "source_software": "pcnet3d", "time_unit": "seconds", "fps": level.fps}
        with needed_for("to_xarray", "xarray"):
            import xarray
        return xarray.Dataset(variables, coordinates, whole)


def in_single(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns (T,) with floats of 32 bits, which are off by 6e-8 of a value at most; codes stay as they are. A
    column that has the same in all rows, such as an error that nobody states, holds it once."""
    single = {}
    for name, column in columns.items():
        values = column.astype(np.float32) if column.dtype == np.float64 else column
        alike = np.array_equal(values[1:], values[:-1], equal_nan=True)
        single[name] = np.broadcast_to(values[:1].copy(), values.shape) if alike else values
    return single
