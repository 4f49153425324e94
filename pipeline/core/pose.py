"""What flows: a person's joints over time and the path of the pelvis, with their errors, and the same after
rectification. Frozen; functions return new ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any, Literal

import numpy as np

from .blocks import blocks
from .errors import InputError
from .frames import BODY, CAMERA, LEVEL, Frame, require
from .layouts import H36M17, Layout
from .messages import how_many, in_one_line, rate_in_words
from .notices import Notice
from .rotations import rotate, transpose


@dataclass(frozen=True, eq=False)
class RootPath:
    """Where the pelvis of joints relative to it is, in their axes and unit, from a point that does not move: the
    camera, the world's origin.

    points: (T, D) float64, NaN where missing.
    covariance: (T, D, D) float64 of the error of a path that was estimated (stages.place), NaN where it is missing;
        None where the source itself knows the place.
    shared: the part of an estimated path's error that all frames share: standard deviations of the body's size and of
        the focal length, as shares of them; None where the source knows the place.
    """

    points: np.ndarray
    covariance: np.ndarray | None = None
    shared: tuple[float, float] | None = None

    @property
    def sd(self) -> np.ndarray | None:
        """(T, D) standard deviation of the error along each axis; None where no error is stated."""
        covariance = self.covariance
        return None if covariance is None else np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

    def each(self, function: Callable[[np.ndarray], np.ndarray]) -> RootPath:
        """A copy with the function's answer for each array that has a row a frame."""
        covariance = None if self.covariance is None else function(self.covariance)
        return replace(self, points=function(self.points), covariance=covariance)

    def moved(self, A: np.ndarray) -> RootPath:
        """A copy for the axes and unit of points A x, A (D, D)."""
        return replace(self, points=rotate(A, self.points), covariance=moved_covariance(self.covariance, A))

    def owned(self, rows: int, dims: int) -> RootPath:
        """Of arrays that nobody can change. InputError where they are not of so many rows and coordinates."""
        path = self.each(lambda values: owned(values, np.float64))
        check_shape("path", path.points, (rows, dims), finite=True)
        check_shape("the path's covariance", path.covariance, (rows, dims, dims))
        return path


def moved_covariance(covariance: np.ndarray | None, A: np.ndarray) -> np.ndarray | None:
    """A C A^T of covariances C (T, D, D) or (T, J, D, D), for A (D, D) or (T, D, D), one a frame, in their own
    precision; None stays None."""
    if covariance is None:
        return None
    A = np.asarray(A, dtype=covariance.dtype)
    A = A[:, None] if A.ndim == 3 and covariance.ndim == 4 else A
    return A @ covariance @ np.swapaxes(A, -1, -2)


def owned(values: Any, dtype: type) -> np.ndarray:
    """The values (T, ...) as an array that nobody can change: itself if it is so already, else a copy."""
    array = np.asarray(values, dtype=dtype)
    if array.base is not None or (array is values and array.flags.writeable):
        array = array.copy()
    array.setflags(write=False)
    return array


def check_shape(name: str, array: np.ndarray | None, shape: tuple[int, ...], finite: bool = False) -> None:
    """InputError for an array that is not of this shape (T, ...), or has infinite values where they are refused."""
    if array is not None and (array.shape != shape or (finite and np.isinf(array).any())):
        what = f"Expected {name} of shape {shape}{', finite or NaN' * finite}"
        raise InputError("wrong-content", f"{what}, got {array.shape}.")


@cache
def package_version() -> str:
    """Of the installed package; every history and summary has it."""
    try:
        return version("pcnet3d")
    except PackageNotFoundError:
        return "unknown"


@dataclass(frozen=True)
class Step:
    """One thing that was done to the data: its name, our version, its options and counts."""

    name: str
    version: str
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class MadeBy:
    """Who made poses, which says what is known of their errors.

    kind: "measured" by motion capture; "estimated" by a network out of images, whose errors are known in a camera's
    axes only (docs/trust.md); "unknown" where neither the file nor the user says. by: the system's or the program's
    name, "" where it is not known. in_run: that they are the lift of a run, out of its own keypoints.
    """

    kind: Literal["measured", "estimated", "unknown"] = "unknown"
    by: str = ""
    in_run: bool = False


UNSAID = MadeBy()


# The fields of PoseSequence with a row a frame: their type, and the shape of a row in letters: J joints, D coordinates.
# Checks, rows, frames that are put in, and whatever else takes a sequence apart go by this and the path.
_PER_FRAME: dict[str, tuple[type, str]] = {
    "joints": (np.float32, "JD"),
    "confidence": (np.float32, "J"),
    "time_s": (np.float64, ""),
    "frame_index": (np.int64, ""),
    "covariance": (np.float32, "JDD"),
}
_OF_JOINTS = [name for name, (_, trailing) in _PER_FRAME.items() if trailing]


@dataclass(frozen=True, eq=False)
class PoseSequence:
    """One person's joints over time.

    joints: (T, J, D) float32 in `frame`; missing is NaN.
    layout, frame: what the joint axis and the coordinate axis mean.
    confidence: (T, J) in [0, 1], NaN where unknown.
    time_s: (T,) strictly increasing seconds, or None while the source's rate is unknown.
    frame_index: (T,) strictly increasing number of each row's video frame, counted from 0; counts the rows
        when the source does not know it, and then `frames_known` is False.
    seams: rows at which the estimator began a new clip without looking at the old one (formats.md 9.5);
        no derivative may be taken across one.
    person: the source's name of the person.
    made_by: who made the poses, as the adapter, the lifter or the user says.
    derived: names of joints that were made out of others and carry no information of their own.
    history: what was done so far, oldest first.
    notices: what makes the poses doubtful, as the adapter or the lifter says.
    path: where the pelvis is, and how well that is known; None when its place is not known.
    covariance: (T, J, D, D) float32 of each joint's error, in `frame` and its unit squared, as the lifter states it for
        a frame; for a take's filtered joints that of the whole error (models/angle_error/joint_noise.py). NaN
        where missing, None if it is not known.
    linked: the source has no names of people, so the adapter followed them from frame to frame and numbered them.
    scene: which scene of the video shows the person, counted from 0; 0 also if cuts are not known.
    detected_in: SHA-256 of the video whose images keypoints were found in and whose frames number them; "" if the
        source does not say.

    Raises InputError when shapes, ranges or order do not fit. Arrays are read-only.
    """

    joints: np.ndarray
    layout: Layout
    frame: Frame
    confidence: np.ndarray = None  # type: ignore[assignment]  # filled with NaN
    time_s: np.ndarray | None = None
    frame_index: np.ndarray = None  # type: ignore[assignment]  # filled with 0, 1, 2, ...
    frames_known: bool = True
    seams: tuple[int, ...] = ()
    person: str = "0"
    history: tuple[Step, ...] = ()
    path: RootPath | None = None
    covariance: np.ndarray | None = None
    made_by: MadeBy = UNSAID
    derived: frozenset[str] = frozenset()
    notices: tuple[Notice, ...] = ()
    linked: bool = False
    scene: int = 0
    detected_in: str = ""

    def __post_init__(self) -> None:
        arrays = {
            name: owned(values, dtype)
            for name, (dtype, _) in _PER_FRAME.items()
            if (values := getattr(self, name)) is not None
        }
        joints, dims = arrays["joints"], self.frame.dims
        expected = f"(frames, {len(self.layout)}, {dims}) for {self.layout.name} in {self.frame.name}"
        if joints.ndim != 3 or joints.shape[1:] != (len(self.layout), dims):
            raise InputError("wrong-content", f"Expected joints of shape {expected}, got {joints.shape}.")
        rows = len(joints)
        if rows == 0:
            raise InputError("nothing-usable", f"Expected joints of shape {expected}, got no frames at all.")
        if np.isinf(joints).any():
            row, joint, _ = np.argwhere(np.isinf(joints))[0]
            raise InputError(
                "file-damaged",
                f"Expected finite coordinates or NaN, got an infinite one at row {row}, joint "
                f"{self.layout.joints[joint]}; the file is damaged or was written by a failed run.",
            )
        if "frame_index" not in arrays:
            arrays["frame_index"] = np.arange(rows)
            object.__setattr__(self, "frames_known", False)
        elif not np.array_equal(arrays["frame_index"], self.frame_index):
            raise InputError(
                "times-broken", "Expected frame_index of whole numbers, those of video frames; got others."
            )
        confidence = arrays.setdefault("confidence", np.full(joints.shape[:2], np.nan, np.float32))
        sizes = {"J": len(self.layout), "D": dims}
        for name, array in arrays.items():
            check_shape(name, array, (rows, *(sizes[letter] for letter in _PER_FRAME[name][1])))
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if np.nanmin(confidence, initial=0) < 0 or np.nanmax(confidence, initial=0) > 1:
            raise InputError(
                "wrong-content",
                "Expected confidences between 0 and 1 or NaN; map the source's scores into that range.",
            )
        for name in ("frame_index", "time_s"):
            values = arrays.get(name, np.zeros(1))
            if not (np.isfinite(values).all() and (values[1:] > values[:-1]).all()):
                raise InputError("times-broken", f"Expected {name} to increase from row to row; it does not.")
        if any(not 0 < seam < rows for seam in self.seams):
            raise InputError("wrong-content", f"Expected seams at rows 1 to {rows - 1}, got {self.seams}.")
        object.__setattr__(self, "seams", tuple(int(seam) for seam in self.seams))
        if self.path is not None:
            object.__setattr__(self, "path", self.path.owned(rows, dims))

    def __len__(self) -> int:
        return len(self.joints)

    def __repr__(self) -> str:
        return f"<PoseSequence: {self.in_words}>"

    @property
    def in_words(self) -> str:
        """Who, how many frames, rate, joints, frame, unit and maker, in a line."""
        rate = ", rate unknown" if self.time_s is None else rate_in_words(self.fps, ", ")
        unit = "no known scale" if self.frame.unit == "arbitrary" else self.frame.unit
        maker = "" if self.made_by.kind == "unknown" else f", {self.made_by.kind}"
        maker += f" by {self.made_by.by}" if self.made_by.by else ""
        return in_one_line(
            f"person {self.person}, {how_many(len(self), 'frame')}{rate}, {self.layout.name} in {self.frame.name}, "
            f"{unit}{maker}"
        )

    def joint(self, name: str) -> np.ndarray:
        """(T, D) positions of one joint."""
        return self.joints[:, self.layout.index(name)]

    @property
    def lifted(self) -> bool:
        """Whether the errors are those of lifted poses: in a camera's axes, and not measured. Estimators in a world's
        axes have not been judged."""
        return self.frame.family == "camera" and self.made_by.kind != "measured"

    @property
    def root(self) -> np.ndarray | None:
        """(T, D) the points of its path."""
        return None if self.path is None else self.path.points

    @property
    def own_root(self) -> np.ndarray | None:
        """(T, D) the root where the source itself says the place, measured or by an estimator that states no error;
        None for one that a run has estimated out of keypoints, which is too uncertain for evidence on up."""
        return None if self.path is None or self.path.covariance is not None else self.path.points

    @property
    def measured_root(self) -> np.ndarray | None:
        """(T, D) that root where no estimator made it, as far as is known: its errors are small. None for others."""
        return None if self.made_by.kind == "estimated" else self.own_root

    @property
    def fps(self) -> float:
        """Video frames per second on average. InputError when the time stamps are unknown."""
        times = self.times
        frames = float(self.frame_index[-1] - self.frame_index[0])
        return frames / float(times[-1] - times[0]) if len(times) > 1 else float("nan")

    @property
    def duration_s(self) -> float:
        """Seconds from the first frame to the end of the last, 0 for a single one. InputError when these are
        unknown."""
        return float(self.times[-1] - self.times[0] + np.nan_to_num(1 / self.fps))

    @property
    def times(self) -> np.ndarray:
        """(T,) seconds. InputError when the source's rate is unknown."""
        if self.time_s is None:
            raise InputError(
                "needs-rate", "The poses have no time stamps: give the frame rate (--fps F) or the video."
            )
        return self.time_s

    def rows(self, start: int, stop: int) -> PoseSequence:
        """A copy of rows `start` to `stop`, without the last, as of a list. InputError where there are none."""
        seams = tuple(seam - start for seam in self.seams if start < seam < stop)
        return replace(self, **self._each(_PER_FRAME, lambda values: values[start:stop]), seams=seams)

    def on_frames(self, frame_index: np.ndarray, time_s: np.ndarray) -> PoseSequence:
        """A copy with a row for each of these frames (N,), which increase and are all of its own and others, at these
        seconds (N,); what a frame without data has is NaN."""
        rows = np.searchsorted(frame_index, self.frame_index)

        def spread(values: np.ndarray) -> np.ndarray:
            result = np.full((len(frame_index), *values.shape[1:]), np.nan, values.dtype)
            result[rows] = values
            return result

        fields, seams = self._each(_OF_JOINTS, spread), tuple(rows[list(self.seams)])
        return replace(self, **fields, frame_index=frame_index, time_s=time_s, seams=seams)

    def _each(self, names: Iterable[str], function: Callable[[np.ndarray], np.ndarray]) -> dict[str, Any]:
        """The function's answer for each of these per-frame fields and for the path, where the sequence has them."""
        held = {name: getattr(self, name) for name in names}
        answers = {name: function(values) for name, values in held.items() if values is not None}
        return answers if self.path is None else {**answers, "path": self.path.each(function)}

    @property
    def without_feet(self) -> PoseSequence:
        """The same in H36M17, without the heels and toes that stand behind; of another layout itself."""
        if self.layout == H36M17 or not self.layout.is_body:
            return self
        fields = self._each(_OF_JOINTS, lambda values: values[:, : len(H36M17)])
        return replace(self, **{**fields, "layout": H36M17, "path": self.path})

    def with_(self, **changes: Any) -> PoseSequence:
        """A copy with other fields, checked again. Other joints, axes or layouts leave no covariance unless it is
        given: the caller that moves the joints moves their errors too."""
        if changes.keys() & {"joints", "layout", "frame"}:
            changes = {"covariance": None, **changes}
        return replace(self, **changes)

    def moved(self, A: np.ndarray, **changes: Any) -> PoseSequence:
        """A copy of all joints x as A x, A (D, D) or, one a frame, (T, D, D), in A's precision, with their errors; the
        path too, but that of turns of each frame's own, which leave none. With other changes as those of `with_`."""
        A = np.asarray(A)
        precision = np.result_type(A, np.float32)
        joints = np.empty(self.joints.shape, np.float32)
        for rows in blocks(len(joints)):
            joints[rows] = rotate(A if A.ndim == 2 else A[rows], self.joints[rows].astype(precision))
        joints.setflags(write=False)
        path = self.path.moved(A) if self.path is not None and A.ndim == 2 else None
        covariance = moved_covariance(self.covariance, A)
        return self.with_(**{"joints": joints, "path": path, "covariance": covariance, **changes})

    def without(self, hidden: np.ndarray, **changes: Any) -> PoseSequence:
        """A copy in which these joints (T, J) are missing, with a confidence of 0; with other changes as those of
        `with_`."""
        return self.with_(
            joints=np.where(hidden[..., None], np.nan, self.joints),
            confidence=np.where(hidden, 0.0, self.confidence),
            **changes,
        )

    def noted(self, step: str, **options: Any) -> PoseSequence:
        """A copy whose history ends with this step."""
        noted = copy(self)  # not checked again: nothing of a file is in this
        object.__setattr__(noted, "history", (*self.history, Step(step, package_version(), options)))
        return noted

    def deriving(self, step: str, how: Mapping[str, str], **options: Any) -> PoseSequence:
        """A copy in which these joints count as made out of others; the history gets a step that says how."""
        noted = self.noted(step, **options, derived=[f"{joint} = {made}" for joint, made in how.items()])
        object.__setattr__(noted, "derived", self.derived | how.keys())
        return noted

    def saying(self, *notices: Notice) -> PoseSequence:
        """A copy with these notices added."""
        return replace(self, notices=(*self.notices, *notices))


TOLD_UP = ("gravity vector", "camera pitch and roll")  # sources of up that the user tells, by name


@dataclass(frozen=True, eq=False)
class Rectified:
    """A skeleton in the canonical frames of design.md section 4.

    level: in LEVEL, one upright frame for the whole take; its root, where the source knows it and the camera stands
        still, is counted from where the source counts: the camera's centre or the world's origin.
    R_source_from_body: (T, 3, 3), the paper's R; NaN where a frame cannot be rectified.
    R_source_from_level: (3, 3), or (T, 3, 3) for a moving camera.
    error_deg: (T,) expected rotation error of BODY in degrees, NaN where the rectifier does not know.
    up_error_deg, up_bound_deg: (T,) for the up that BODY and LEVEL share: its expected root mean square angle to the
        truth, and the angle that nine in ten takes stay under. up_votes: (T, 3) each frame's own estimate of up, in
        the source's axes; in a long take some frames have that of their neighbours; NaN without one.
        up_shares: the share of each source of up, by name; up_own: the up of each source by itself, in the source's
        axes, and its error in degrees.
    method: "geometric", "pcnet@<hash>" or, of a file, "mine.onnx@<hash>".
    source: the axes that the poses come in. camera: "static" or "moving"; None for a world, which knows its own up.
    level_heading: how LEVEL's heading was chosen: "median", "first second", "camera", "world", or "none"
        where no frame has a heading.
    level_ok, level_reason: whether the take could be levelled, and in words why not.
    """

    level: PoseSequence
    R_source_from_body: np.ndarray
    R_source_from_level: np.ndarray
    error_deg: np.ndarray
    method: str
    level_heading: str
    level_ok: bool = True
    level_reason: str = ""
    source: Frame = CAMERA
    camera: Literal["static", "moving"] | None = "static"
    up_error_deg: np.ndarray = None  # type: ignore[assignment]  # filled with NaN
    up_bound_deg: np.ndarray = None  # type: ignore[assignment]  # filled with NaN
    up_votes: np.ndarray = None  # type: ignore[assignment]  # filled with NaN
    up_shares: dict[str, float] = field(default_factory=dict)
    up_own: dict[str, tuple[np.ndarray, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require(self.level.frame, LEVEL, "Rectified.level")
        rows = len(self.level)
        shapes = {
            "R_source_from_body": (rows, 3, 3),
            "R_source_from_level": (3, 3) if np.ndim(self.R_source_from_level) == 2 else (rows, 3, 3),
            "error_deg": (rows,),
            "up_error_deg": (rows,),
            "up_bound_deg": (rows,),
            "up_votes": (rows, 3),
        }
        for name, shape in shapes.items():
            value = getattr(self, name)
            array = owned(np.full(shape, np.nan) if value is None else value, np.float64)
            check_shape(name, array, shape)
            object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        return f"<Rectified: {self.level.in_words}; {'' if self.level_ok else 'not '}levelled>"

    @property
    def body(self) -> PoseSequence:
        """In BODY, every frame turned upright and facing -X; made when it is asked for, for a long take would hold it
        beside `level`."""
        R_body_from_level = (transpose(self.R_source_from_body) @ self.R_source_from_level).astype(np.float32)
        return self.level.moved(
            R_body_from_level, frame=BODY.with_(unit=self.level.frame.unit), covariance=None
        )

    @property
    def in_world(self) -> bool:
        """Whether the poses come in a world's axes, whose up is not estimated."""
        return self.source.family == "world"

    @property
    def turned(self) -> np.ndarray:
        """(T,) bool, the frames that could be rectified. In the others a moving camera's up comes from distant frames,
        so its error there says nothing about the person."""
        return np.asarray(np.isfinite(self.R_source_from_body).all(axis=(1, 2)))
