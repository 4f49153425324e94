"""JSON of frames and the people in them, whoever wrote it: detections in a flat list, frames with a list of people,
people by image, one such object a line, or a folder with a file a frame; and keypoints in the spellings in use.

MMPose's demos write {meta_info, instance_info: [{frame_id from 1, instances}]}, its inferencer a list of {frame_id from
0, instances}, and of images a folder with a list of instances each, which may be in `predictions`. OpenPose fills a
folder with `<video>_<number>_keypoints.json`; others name the files otherwise (Pose2Sim: cam01.0000.json).
"""

from __future__ import annotations

import codecs
import json
import re
import reprlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import from_json

from ...pipeline.core.errors import InputError
from ...pipeline.files.opened import first_bytes, whole_text
from .clock import Moments, frame_number, kind_of, of_kind, plain, stem

_PEEK_BYTES = 1 << 16  # more than the metadata that MMPose's demos write before the first frame
# Of characters beyond 16 bits, or of names of files that are no text: alone they are none, which pydantic refuses.
_HALVES = re.compile(r"(?<!\\)\\u[dD][89a-fA-F]..")
_PEOPLE = (
    "instances",
    "detections",
    "people",
    "persons",
    "predictions",
    "poses",
    "objects",
    "bodies",
    "annotations",
    "annots",
    "body_list",
    "instance_info",
)
_KEYPOINTS = (
    "keypoints",
    "pose_keypoints_2d",
    "pose_keypoints",
    "joints",
    "keypoints_2d",
    "kpts",
    "pred_xyz_jts",
)
OPENPOSE_3D = ("pose_keypoints_3d", "body_keypoints_3d")  # as older documents call it
KEYPOINTS_3D = ("keypoints3d", "joint_positions", "keypoint", *OPENPOSE_3D)  # of EasyMocap, Azure Kinect, ZED
_SCORES = ("keypoint_scores", "keypoints_scores", "keypoints_score", "keypoints_conf", "scores", "kpt_scores")
_SCORE = ("score", "visible", "conf", "confidence", "visibility", "c", "v")  # of one point
_FROM_1 = "instance_info"
_ENDING = "_keypoints.json"
_LAST_NUMBER = re.compile(r"[0-9]+(?=[^0-9]*$)")
_PEEKED = 100  # files of a folder; nobody may be there in the first ones


def beginning(path: Path) -> Any:
    """The first 64 KB of a JSON file as Python values, cut at a comma, of JSON Lines as a list of the first ones; None
    for anything else. Never raises."""
    start = first_bytes(path, _PEEK_BYTES)
    try:
        if lines := _lines(start):
            return [*map(json.loads, lines)]
        text = _HALVES.sub("?", start.decode("utf-8-sig", errors="ignore"))
        if text.lstrip()[:1] not in ("[", "{"):
            return None
        try:
            return from_json(text)
        except ValueError:
            return from_json(text[: text.rfind(",")], allow_partial=True)
    except (ValueError, RecursionError):
        return None


def _lines(start: bytes) -> list[bytes]:
    """The whole lines of JSON Lines, one object or list each; none of other JSON."""
    lines = start.removeprefix(codecs.BOM_UTF8).strip().splitlines()
    wholes = [line.strip() for line in lines[: -1 if len(start) == _PEEK_BYTES else None]]
    ends = {b"{": b"}", b"[": b"]"}
    several = len(lines) > 1 and all(line and ends.get(line[:1]) == line[-1:] for line in wholes)
    return wholes if several else []


def load(path: Path, what: str) -> Any:
    """The values of a whole JSON file. InputError, saying that `what` was expected, when it cannot be read."""
    text = whole_text(path, what)
    try:
        return (
            [*map(json.loads, text.splitlines())] if _lines(text[:_PEEK_BYTES].encode()) else json.loads(text)
        )
    except json.JSONDecodeError as error:
        raise InputError(
            "file-damaged",
            f"Expected {what} in {path}, but its JSON is incomplete or damaged at line {error.lineno}, column "
            f"{error.colno}; write or copy the file again.",
        ) from None
    except (RecursionError, ValueError):  # nested too deeply; an integer of thousands of digits
        raise InputError(
            "format-unknown", f"Expected {what} in {path}, got JSON of a kind that no detector writes."
        ) from None


def each(path: Path, what: str) -> Iterator[tuple[str, Any]]:
    """The elements of a JSON file: of a list, and of JSON Lines, ("", element) of each; of an object (key, element) of
    each value that is a list, and (key, value) of anything else in it. InputError as for `load`, and for anything
    else."""
    content = load(path, what)
    if not isinstance(content, list | dict):
        raise InputError(
            "format-unknown", f"{path}: expected a list or an object, got {reprlib.repr(content)}."
        )
    if isinstance(content, dict) and lists_images(content):
        content = _by_names_of_images(content, str(path))
    held = content if isinstance(content, dict) else {"": content}
    for key, value in held.items():
        if isinstance(value, list):
            yield from ((key, element) for element in value)
        else:
            yield key, value


def lists_images(content: Any) -> bool:
    """Whether it is COCO's annotations: a dict whose images have numbers and names."""
    listed = content.get("images") if isinstance(content, dict) else None
    first = listed[0] if isinstance(listed, list) and listed else None
    return isinstance(first, dict) and first.keys() >= {"id", "file_name"}


def _by_names_of_images(content: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """COCO's annotations that have keypoints, with the names of their images in place of the numbers."""
    images, annotations = (
        part if isinstance(part, list) else [part]
        for part in (content["images"], field(content, "annotations", where))
    )
    names = {
        str(field(image, "id", f"{where}, image {i}")): str(field(image, "file_name", f"{where}, image {i}"))
        for i, image in enumerate(images)
    }
    named, numbered = [], dict[str, str]()
    for i, entry in enumerate(annotations):
        image = str(field(entry, "image_id", f"{where}, annotation {i}"))
        if image not in names:
            raise InputError(
                "wrong-content",
                f"{where}, annotation {i}: expected an image that the file lists, got {image!r:.60}.",
            )
        if "keypoints" not in entry:
            continue
        if numbered.setdefault(names[image], image) != image:
            raise InputError(
                "files-apart",
                f"{where}: expected the images of one video, each with a name of its own, got {names[image]} twice; "
                "keep each video's keypoints in a file of their own.",
            )
        named.append(entry | {"image_id": names[image]})
    return named


def field(entry: Any, key: str, where: str) -> Any:
    """entry[key]; InputError when the entry is no JSON object or lacks the key."""
    if not isinstance(entry, dict) or key not in entry:
        raise InputError(
            "wrong-content", f"{where}: expected an object with '{key}', got {reprlib.repr(entry)}."
        )
    return entry[key]


def numbers(values: Any, where: str) -> np.ndarray:
    """Nested lists as a float64 array (...,), null as NaN; InputError for anything but finite numbers in equal
    lengths."""
    try:
        array = np.array(values, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        array = np.array(np.inf)
    if np.isinf(array).any():
        raise InputError(
            "wrong-content",
            f"{where}: expected finite numbers in lists of equal length, got {reprlib.repr(values)}.",
        )
    return array


def first_person(path: Path, fields: Sequence[str] = ()) -> tuple[Mapping[str, Any], bool] | None:
    """The first person in the beginning of such a file or folder, and whether a list of detections has them, not a
    frame; None for anything else. fields: of which the person has one that is filled. Never raises."""
    if path.is_dir():
        entries: list[Any] = [beginning(file) for file in frame_files(path)[:_PEEKED]]
    elif isinstance(content := beginning(path), dict):
        lists = [value for value in content.values() if isinstance(value, list)]
        entries = next(
            (held for held in lists if held and people_of(held[0]) is not None), [*content.values()]
        )
    else:
        entries = content if isinstance(content, list) else []
    for entry in entries:
        people = people_of(entry)
        if people is None:
            return None
        people = [person for person in people if not fields or any(person.get(key) for key in fields)]
        if people:
            return people[0], people[0] is entry
    return None


def people_of(entry: Any) -> list[Any] | None:
    """Everybody of one entry, as objects: of a frame the people, of a detection itself; None for anything else. ml5 has
    a person's keypoints in `pose`."""
    listed = entry
    if isinstance(entry, dict):
        if any(key in entry for key in (*_KEYPOINTS, *KEYPOINTS_3D)):
            return [entry]
        listed = next((entry[key] or [] for key in _PEOPLE if key in entry), None)
    if not isinstance(listed, list) or not all(isinstance(person, dict) for person in listed):
        return None
    return [person["pose"] if isinstance(person.get("pose"), dict) else person for person in listed]


def people(path: Path, what: str, moments: Moments) -> Iterator[tuple[int, Any, str]]:
    """Moment, person and place of everybody in the file or folder; frames without anybody count. what: in words.

    InputError when it cannot be read, for an entry that holds no people, and for a folder whose files are not those of
    one video, each with a number.
    """
    expected = f"an object with '{_KEYPOINTS[0]}', or a frame with a list of people"
    for moment, entry, where in frames(
        path, what, expected, moments, lambda key, entry: people_of(entry) is not None
    ):
        yield from ((moment, person, where) for person in people_of(entry) or ())


def frames(
    path: Path, what: str, expected: str, moments: Moments, is_frame: Callable[[str, Any], bool]
) -> Iterator[tuple[int, Any, str]]:
    """Moment, entry and place of each frame. what, expected: the file, and an entry of it, in words. is_frame: whether
    an entry is one, by its key and itself; what stands beside frames in an object is told to the moments.

    InputError for a file that cannot be read, an entry that is no frame, and a file or folder without any.
    """
    if path.is_dir():
        for number, file in numbered_files(path, frame_files(path), what):
            entry = load(file, what)
            if not is_frame("", entry):
                raise InputError("wrong-content", f"{file}: expected {expected}, got {entry!r:.60}.")
            yield moments.of({"frame": number}, str(file)), entry, str(file)
        return
    listed, count = None, 0
    for key, entry in each(path, what):
        where = f"{path}, entry {count}"
        if not is_frame(key, entry):
            if key in ("", listed):
                raise InputError("wrong-content", f"{where}: expected {expected}, got {entry!r:.60}.")
            moments.state(key, entry)
            continue
        listed, count = key, count + 1
        fields = entry if isinstance(entry, dict) else {}
        if key == _FROM_1 and "instances" in fields:
            fields = fields | {"frame_id": _from_1(fields, where)}
        elif plain(key) in _PEOPLE and not any(
            kind_of(name) in ("frame", "image", "time") for name in fields
        ):
            fields = {"frame": 0}  # everybody of one image
        elif re.search(r"[\d.]", key):  # an object of images by their names
            fields = fields | {"frame_name": key}
        yield moments.of(fields, where), entry, where
    if listed is None:
        raise InputError(
            "format-unknown", f"{path}: expected {what} in a list of people or of frames, found none."
        )


def _from_1(fields: Mapping[str, Any], where: str) -> int:
    frame = frame_number(fields.get("frame_id"), where)
    if frame < 1:
        raise InputError(
            "times-broken", f"{where}: expected frames from 1, as MMPose's demos count, got frame 0."
        )
    return frame - 1


def frame_files(path: Path) -> list[Path]:
    """A folder's files of frames, sorted by name; none for anything else."""
    folder = path / "predictions" if (path / "predictions").is_dir() else path
    files = sorted(file for file in folder.glob("*.json") if not file.name.startswith("."))
    return [file for file in files if file.name.endswith(_ENDING)] or [
        file for file in files if _LAST_NUMBER.search(file.stem)
    ]


def numbered_files(path: Path, files: Sequence[Path], what: str) -> list[tuple[int, Path]]:
    """Number and file of each frame in a folder, in order: the last number in a name counts, before what all names end
    with. what: in words. InputError without any file, for one without a number, and for those of several videos."""
    if not files:
        raise InputError(
            "format-unknown",
            f"Expected {what} in a folder of files numbered by frame (walk_0000{_ENDING}, cam01.0000.json) at {path}, "
            "found none there.",
        )
    names = [stem(file.name).removesuffix("_keypoints") for file in files]
    if len(names) > 1:
        alike = takewhile(lambda marks: len({*marks}) == 1, zip(*map(reversed, names), strict=False))
        ending = "".join(mark for mark, *_ in alike)[::-1].lstrip("0123456789")
        names = [name.removesuffix(ending) for name in names]
    frames = sorted((frame_number(name, str(file)), file) for name, file in zip(names, files, strict=True))
    videos = sorted({_LAST_NUMBER.sub("*", name) for name in names})
    if len(videos) > 1 or len({number for number, _ in frames}) < len(frames):
        raise InputError(
            "files-apart",
            f"Expected the frames of one video in {path}, each with a number of its own, got "
            f"{' and '.join(videos[:2])}; give each video a folder of its own.",
        )
    return frames


def keypoints_of(person: Any, where: str) -> tuple[np.ndarray, np.ndarray]:
    """(J, 2) x and y of a person's joints, and (J,) their scores, NaN where missing. InputError for a person without
    keypoints, for those of another form, and for three coordinates each."""
    key = next((key for key in _KEYPOINTS if key in person), None) if isinstance(person, dict) else None
    if key is None:
        raise InputError(
            "wrong-content", f"{where}: expected an object with '{_KEYPOINTS[0]}', got {person!r:.80}."
        )
    held, scores, flat = person[key], _first(person, _SCORES), False
    if isinstance(held, dict):  # Ultralytics
        score = _first(held, _SCORE)
        held = [held.get("x"), held.get("y"), *([] if score is None else [score])]
        values = numbers(held, where).T
    elif isinstance(held, list) and held and isinstance(held[0], dict):  # TF.js
        values = numbers([by_name(point, "xy") for point in held], where)
    else:
        values = numbers(held, where)
        if values.ndim == 1 and len(values) and not len(values) % 3:
            values, flat = values.reshape(-1, 3), True
    if isinstance(scores, list) and not flat:  # PoseTrack's stand beside flags
        joint_scores = numbers(scores, where)
        if values.ndim == 2 and values.shape[1] == 3:
            raise InputError(
                "format-unknown",
                f"{where}: expected 2D keypoints, got three coordinates each: a 3D output; give it with --poses.",
            )
        fit = values.shape == (*joint_scores.shape, 2)
        values = np.column_stack([values, joint_scores]) if fit else np.empty((0, 0))
    if values.ndim != 2 or values.shape[1] not in (2, 3) or not len(values):
        raise InputError(
            "wrong-content",
            f"{where}: expected x, y and one score of each joint, got {reprlib.repr(person)}.",
        )
    return values[:, :2], values[:, 2] if values.shape[1] == 3 else np.full(len(values), np.nan)


def by_name(point: Any, axes: str) -> list[Any] | None:
    """The coordinates of a point and its score, as TF.js and MediaPipe have them, or PoseNet with the place in
    `position`."""
    if not isinstance(point, dict):
        return None
    place = point["position"] if isinstance(point.get("position"), dict) else point
    return [*(place.get(axis) for axis in axes), _first(point, _SCORE)]


def surely_2d(person: Mapping[str, Any]) -> bool:
    """Whether a person's keypoints are of the image by their form: x, y, score in one list, x and y apart, or scores
    beside pairs. Lists of three numbers and points by x, y, z may be 3D."""
    held = _first(person, _KEYPOINTS)
    flat = isinstance(held, list) and bool(held) and isinstance(held[0], int | float)
    return flat or isinstance(held, dict) or isinstance(_first(person, _SCORES), list)


def name_of(person: Mapping[str, Any]) -> str | None:
    """The person's number or name in the file, AlphaPose's `idx` first; None where it names nobody."""
    # COCO's annotations have numbers of their own.
    keys = [key for key in person if key != "id" or "image_id" not in person]
    name = next((person[key] for key in ("idx", *of_kind("person", keys)) if key in person), None)
    if isinstance(name, float) and name % 1 == 0:
        name = int(name)
    return None if name is None or isinstance(name, list | dict) or name == -1 else str(name)


def _first(held: Mapping[str, Any], keys: tuple[str, ...]) -> Any:
    return next((held[key] for key in keys if key in held), None)
