"""Which video frame a row of a table or an entry of JSON is, and at which second: one table of the names of such
columns and fields, for all readers.

What a name leaves open is decided by the values: the unit of a bare "timestamp", whether "image" holds numbered images
or the name of one video. A notice names what looks like a clock and is not used.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from posixpath import dirname
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.notices import Notice, notice

# By the plain name (`plain`); of several of a kind the first in this table counts.
_NAMES = {
    "frame": ("frame", "frame_index", "frame_idx", "frame_number", "frame_num", "frame_no", "frame_nr", "frame_id",
              "frame_count", "frames", "fnum", "video_frame", "f"),
    "image": ("image_id", "image", "image_name", "image_file", "image_path", "img", "img_id", "img_name", "img_path",
              "frame_name", "frame_path", "frame_file", "file_name", "filename", "file", "file_path", "path"),
    "recording": ("video", "video_name", "video_file", "video_id", "video_path", "clip", "clip_name", "clip_id",
                  "recording", "sequence", "sequence_id", "trial", "trial_id", "session"),
    "person": ("person", "person_id", "person_index", "person_idx", "track_id", "track", "tid", "pid", "player",
               "player_id", "individual", "individuals", "subject_id", "instance_id", "object_id", "body_id", "pose_id",
               "id"),
    "rate": ("fps", "frame_rate", "framerate", "video_fps", "sampling_rate", "sample_rate"),
}  # fmt: skip
_UNITS = {  # by the seconds of one; None where the values show them
    None: ("time", "timestamp", "t", "stamp", "time_stamp", "clock", "video_time", "frame_time", "pts_time"),
    1.0: ("time_s", "timestamp_s", "seconds", "second", "sec", "secs", "time_sec", "timestamp_sec", "time_seconds",
          "t_s", "video_time_s", "timestamp_seconds"),
    1e-3: ("time_ms", "timestamp_ms", "milliseconds", "ms", "msec", "time_msec", "t_ms", "time_milliseconds",
           "video_time_ms", "pos_msec", "timestamp_milliseconds"),
    1e-6: ("time_us", "timestamp_us", "microseconds", "us", "time_usec", "t_us", "timestamp_usec"),
    1e-9: ("time_ns", "timestamp_ns", "nanoseconds", "ns", "t_ns"),
}  # fmt: skip
_SECONDS = {name: unit for unit, names in _UNITS.items() for name in names}
_KINDS = {name: kind for kind, names in _NAMES.items() for name in names} | dict.fromkeys(_SECONDS, "time")
_LIKE = re.compile(
    r"frame|time|stamp|clock|tick|count|sample|image|index|(^|_)(idx|no|nr|num|secs?|ms|us)(_|$)"
)
_UNNAMED = re.compile(r"(unnamed(_\d+)?)?")  # as pandas writes and reads the index of its rows

_USUAL_HZ = (4.0, 500.0)  # rows a second by which a unit shows; no two units fit one step
_SUFFIX = re.compile(r"\.[A-Za-z][A-Za-z0-9]*$")
# Roboflow's exports put a hash behind the name: walk_mp4-0003_jpg.rf.0f31b2.jpg
_ROBOFLOW = re.compile(r"\.rf\.\w+$")
_MOST = 1 << 53  # larger numbers are no video frames, and would not fit an int64

_MILLISECONDS = 12  # steps of whole numbers from which on they are times
_CALENDAR_S = 1e6  # later times are a calendar's, and are counted from the first one


@lru_cache(1 << 12)
def plain(name: str) -> str:
    """A name in small letters, its words joined by _: "frameNumber", "Frame number" and "frame.number" are alike."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name.strip())
    return re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")


@lru_cache(1 << 12)
def kind_of(name: str) -> str:
    """What a column or field of that name says: "frame", "image", "time", "recording", "person" or "rate"; "unnamed"
    for one without a name, "like" for a name that sounds like a clock's, "" for any other."""
    kind = _KINDS.get(plain(name), "")
    if kind:
        return kind
    return "unnamed" if _UNNAMED.fullmatch(plain(name)) else "like" * bool(_LIKE.search(plain(name)))


def of_kind(kind: str, names: Iterable[str]) -> list[str]:
    """The names of that kind among those of columns or fields, those first that the table of names has first."""
    order = list(_KINDS)
    named = [name for name in names if kind_of(name) == kind]
    return sorted(named, key=lambda name: order.index(plain(name)) if plain(name) in _KINDS else 0)


@dataclass(frozen=True, eq=False)
class Clock:
    """Of each moment of a file, by its number: index (M,) its video frame; time_s (M,) seconds, None where nothing
    tells them. known: whether the frames are the file's own numbers, or were counted. notices: what is to be said."""

    index: np.ndarray
    time_s: np.ndarray | None
    known: bool
    notices: tuple[Notice, ...] = ()


class Moments:
    """When the people of a file were seen. It gets the file's rows one by one, numbers their moments from 0 on, and
    makes a `Clock` of them once all are read."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._rows: list[dict[str, Any]] = []  # by moment, what its first row says of it
        self._numbers: dict[frozenset[tuple[str, Any]], int] = {}  # of the moments that say when they were
        self._silent: dict[str | None, int] = {}  # the last moment of each person that does not
        self._rate: float | None = None

    def of(self, row: Mapping[str, Any], where: str, person: str | None = None) -> int:
        """The number of a row's moment; rows without frame or time are numbered on, for each person separately.

        row: its values under any names; what is no clock's does not matter. where: which row it is, for errors.
        InputError for a frame that is no whole number.
        """
        fields: dict[str, Any] = {}
        for name, value in row.items():
            kind = kind_of(name)
            if kind == "rate":
                self.state(name, value)
            elif kind not in ("", "person") and isinstance(value, str | int | float | None):
                fields[name] = _whole(value, name, where) if kind == "frame" else value
        kinds = {kind_of(name) for name in fields}
        # Of a frame the times may differ from row to row.
        tell = {"frame", "image"} if kinds & {"frame", "image"} else {"time", "unnamed"}
        key = frozenset(item for item in fields.items() if kind_of(item[0]) in {*tell, "recording"})
        if key:
            number = self._numbers.setdefault(key, len(self._rows))
        else:
            number = self._silent[person] = self._silent.get(person, -1) + 1
        if number == len(self._rows):
            self._rows.append(fields)
        return number

    def state(self, key: str, value: Any) -> None:
        """What a file says of itself beside its rows: its frame rate, maybe among other things in an object."""
        if isinstance(value, Mapping):
            for name, inner in value.items():
                if not isinstance(inner, Mapping):
                    self.state(name, inner)
        elif kind_of(key) == "rate" and (rate := _number(value)) is not None and 0 < rate < np.inf:
            self._rate = rate

    def clock(self) -> Clock:
        """The clock of all moments. InputError for frames that are no whole numbers, for times that do not increase
        with them, and for several recordings."""
        names = dict.fromkeys(name for row in self._rows for name in row)
        columns = {name: [row.get(name) for row in self._rows] for name in names}
        self._refuse_several_recordings(columns)
        frame_name, frames = self._frames(columns)
        time_name, time_s = _times(columns)
        if frames is not None:
            index = frames
            self._check_order(index, time_s, time_name)
        else:
            index = np.arange(len(self._rows)) if time_s is None else _counted(time_s)
        if time_s is None and self._rate is not None:
            time_s = index / self._rate
        unused = (
            name
            for name, values in columns.items()
            if name not in (frame_name, time_name)
            and not (time_name and kind_of(name) == "time")
            and _like_a_clock(name, values, frames)
        )
        notices = (notice("clock-not-used", column=name or "(the column without a name)") for name in unused)
        return Clock(index, time_s, frames is not None, tuple(notices))

    def _refuse_several_recordings(self, columns: Mapping[str, list[Any]]) -> None:
        for name in (*of_kind("recording", columns), *of_kind("image", columns)):
            values = [str(value) for value in columns[name] if value is not None]
            names = list(dict.fromkeys(values))
            numbers = kind_of(name) == "image" and all(isinstance(v, int | float) for v in columns[name])
            if 1 < len(names) < len(values) and not numbers:
                raise InputError(
                    "files-apart",
                    f"{self._where} holds {len(names)} recordings, by '{name}': {', '.join(names[:6])}; keep each in a "
                    "file of its own.",
                )

    def _frames(self, columns: Mapping[str, list[Any]]) -> tuple[str | None, np.ndarray | None]:
        """The field that numbers the frames, and the numbers (M,)."""
        for name in of_kind("frame", columns):
            if (numbers := _numbers(columns[name])) is not None:
                return name, numbers.astype(np.int64)
        for name in of_kind("image", columns):
            values = columns[name]
            numbered = len(values) > 1 or re.search(r"\d", str(values[0]))
            if numbered and len(set(values)) == len(values):
                return name, self._numbered(values)
        for name in of_kind("unnamed", columns):
            numbers = _numbers(columns[name])
            if numbers is None or len(numbers) < 2 or _counts_rows(numbers):
                continue
            if (numbers % 1 == 0).all() and 0 < np.diff(numbers).min() < _MILLISECONDS:
                return name, numbers.astype(np.int64)
        return None, None

    def _numbered(self, images: Sequence[Any]) -> np.ndarray:
        """Numbers of images by their names. InputError for one that has none, and for two images of one number."""
        names: dict[int, str] = {}
        for image in images:
            text = str(image).replace("\\", "/")
            other = names.setdefault(frame_number(image, self._where), text)
            first = next(iter(names.values()))
            if other != text or dirname(first) != dirname(text):
                raise InputError(
                    "files-apart",
                    f"{self._where}: expected the images of one video, in one folder, each with a number of its own, "
                    f"got {text} beside {other if other != text else first}; keep each video's keypoints in a file of "
                    "their own.",
                )
        return np.array(list(names), dtype=np.int64)

    def _check_order(self, index: np.ndarray, time_s: np.ndarray | None, name: str | None) -> None:
        """InputError for times that do not increase with the frames."""
        order = np.argsort(index, kind="stable")
        wrong = [] if time_s is None else order[1:][np.diff(time_s[order]) <= 0]
        if time_s is not None and len(wrong):
            raise InputError(
                "times-broken",
                f"{self._where}: expected '{name}' to increase from frame to frame, got {time_s[wrong[0]]:.6g} s at "
                f"frame {index[wrong[0]]}; correct it, or leave it out and give the frame rate (--fps).",
            )


def _times(columns: Mapping[str, list[Any]]) -> tuple[str | None, np.ndarray | None]:
    """The field of the times, and seconds (M,)."""
    for name in of_kind("time", columns):
        if (values := _numbers(columns[name])) is None:
            continue
        dates = any(isinstance(value, str) and ":" in value for value in columns[name])
        if unit := 1.0 if dates else _SECONDS[plain(name)] or _seconds_of_one(values):
            seconds = values * unit
            return name, seconds - seconds[0] if np.abs(seconds).max() > _CALENDAR_S else seconds
    return None, None


def _counted(time_s: np.ndarray) -> np.ndarray:
    """Frame numbers from 0 by the times: a step of about n usual ones is n frames."""
    order = np.argsort(time_s, kind="stable")
    steps = np.diff(time_s[order])
    if not len(steps):
        return np.zeros(len(time_s), dtype=np.int64)
    # The median is of rounded times (33, 33, 34 ms), which over a long gap would miss frames; the mean is not.
    median = np.percentile(steps, 50, method="lower")  # one of them, where two kinds of steps alternate
    usual = steps[np.rint(steps / median) == 1].mean()
    index = np.empty(len(time_s), dtype=np.int64)
    index[order] = np.cumsum([0, *np.fmax(np.rint(steps / usual), 1)])
    return index


def _like_a_clock(name: str, values: Sequence[Any], frames: np.ndarray | None) -> bool:
    """Whether a field that is not used may well be a clock: it increases, and says more than how many rows there are,
    or which frame a row is."""
    numbers = _numbers(values)
    if numbers is None or len(numbers) < 3 or not (np.diff(numbers) > 0).all():
        return kind_of(name) == "time" and len(set(values)) > 1
    return not _counts_rows(numbers) and not (frames is not None and len(set(numbers - frames)) == 1)


def stem(image: str) -> str:
    """An image's or file's name without what kind of file it is."""
    return _ROBOFLOW.sub("", _SUFFIX.sub("", image))


def frame_number(image: Any, where: str) -> int:
    """The video frame of an image: the number itself, or the last number in a name such as "clip_0012.jpg". InputError
    for anything else."""
    number = image
    if isinstance(image, str):
        digits = re.findall(r"0*([0-9]+)", stem(image))
        number = int(digits[-1]) if digits and len(digits[-1]) < 20 else None
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < _MOST:
        raise InputError(
            "wrong-content",
            f'{where}: expected an image that is numbered by its video frame, such as 12 or "12.jpg", '
            f"got {reprlib.repr(image)}.",
        )
    return number


def _whole(value: Any, name: str, where: str) -> int:
    number = _number(value)
    if number is None or not 0 <= number < _MOST or number % 1:
        raise InputError(
            "wrong-content", f"{where}: expected a frame's number as '{name}', got {value!r:.60}."
        )
    return int(number)


def _number(value: Any) -> float | None:
    """A number, or the seconds of a date and its time; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return None
    for parse in (float, lambda value: datetime.fromisoformat(str(value).strip()).timestamp()):
        try:
            return parse(value)
        except (ValueError, OverflowError):
            continue
    return None


def _numbers(values: Sequence[Any]) -> np.ndarray | None:
    """(M,) float64; None unless all are finite numbers."""
    parsed = [_number(value) for value in values]
    array = np.array([np.nan if number is None else number for number in parsed])
    return array if np.isfinite(array).all() else None


def _counts_rows(values: np.ndarray) -> bool:
    """Whether numbers only count the rows, from 0 or 1 on."""
    return bool(values[0] in (0, 1) and (np.diff(values) == 1).all())


def _seconds_of_one(values: np.ndarray) -> float | None:
    """The unit of increasing times, by how many of the usual step make a second; None where it does not show."""
    steps = np.diff(values)
    if not len(steps) or not (steps > 0).all():
        return None
    if (values == np.rint(values)).all() and steps.min() < _MILLISECONDS:
        return None
    usual = float(np.median(steps))
    fits = (unit for unit in _UNITS if unit and _USUAL_HZ[0] <= 1 / (usual * unit) <= _USUAL_HZ[1])
    return next(fits, None)
