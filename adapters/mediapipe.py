"""MediaPipe Pose's world landmarks, as people save them, for there is no official writer (formats.md 5).

A table has x, y, z (and visibility) of 33 landmarks in one row a frame, or one row a landmark. JSON is a list of
frames, or an object that holds one, and a frame has `pose_world_landmarks` (under a name of `_WORLD`) of one person or
of several, or is the 33 landmarks itself. An array is (frames, 33, 3 or 4).

World landmarks are metres in camera axes (z negative towards the camera), the middle of the hips at the origin of
every frame, so that the body does not move through space. Image landmarks are shares of the image's width and
height with a z that is no length: they are recognised and refused. Visibility is MediaPipe's own likelihood that a
landmark is visible. A selfie video is often mirrored before MediaPipe sees it: left and right are then
exchanged in a way that nothing in the file shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import BLAZEPOSE33
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import peek, plain_array
from .kit.clock import Clock, Moments, plain
from .kit.json import beginning, by_name, frames, numbers
from .kit.people import People
from .kit.tables import header_of, read_points

name = "mediapipe"
gives = "poses"
made_by = MadeBy("estimated", "MediaPipe")
reads = "MediaPipe Pose world landmarks in CSV, JSON or .npy, metres; image landmarks are refused"

COUNT = len(BLAZEPOSE33)
_WORLD = (
    "pose_world_landmarks",
    "world_landmarks",
    "pose_world",
    "landmarks_world",
    "keypoints3d",
    "keypoints_3d",
)
_IMAGE = ("pose_landmarks", "landmarks")
_AXES = ("x", "y", "z", "visibility")
_SHAPES = (("frames", COUNT, 3), ("frames", COUNT, 4))
_ROOT_M = 0.1  # the hips' middle is at the origin but for rounding
_HIPS = BLAZEPOSE33.indices(["l_hip", "r_hip"])
_IMAGE_REASON = (
    "image landmarks, whose x and y are shares of the image's width and height and whose z is not a length; save "
    "pose_world_landmarks instead of pose_landmarks"
)


def spelled(joint: str) -> str:
    """MediaPipe's own name of a joint in small letters, such as left_eye_inner and mouth_left."""
    side = {"l_": "left", "r_": "right"}.get(joint[:2])
    if side is None:
        return joint
    return f"mouth_{side}" if joint[2:] == "mouth" else f"{side}_{joint[2:]}"


_NAMES = [spelled(joint) for joint in BLAZEPOSE33.joints]


def sniff(path: Path) -> bool:
    """Whether the file has MediaPipe's landmarks, of the world or of the image, which `read` refuses."""
    if (array := peek(path, *_SHAPES)) is not None:
        return _off_origin(array[..., :3]) < _ROOT_M
    content = beginning(path)
    if content is None:
        header = header_of(path)
        if header is None or header.dims != 3:
            return False
        landmarks = header.label is None or plain(header.names[header.label]).startswith("landmark")
        return landmarks and _order(header.points) is not None
    if isinstance(content, dict):
        if _key(content, _WORLD):
            return True
        content = next((value for value in content.values() if isinstance(value, list) and value), None)
    for frame in content if isinstance(content, list) else ():
        if isinstance(frame, list) and frame and isinstance(frame[0], dict) and _key(frame[0], _WORLD):
            return True  # people of TF.js
        if isinstance(frame, dict):
            landmarks = frame.get(_key(frame, _IMAGE[1:]) or "")
            return bool(_key(frame, (*_WORLD, *_IMAGE[:1]))) or _are_landmarks(landmarks)
        if frame:
            return _are_landmarks(frame)
    return False


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame: BLAZEPOSE33 in camera axes, metres.

    Frame numbers and times are those of the file (kit/clock.py); with times alone the numbers are counted by these, so
    that frames which were dropped leave a gap. A frame whose numbers are all -1, as some write for nobody, or all
    missing has no row, but counts. Raises InputError for image landmarks and for files of another form.
    """
    sightings, clock = People(str(path)), None
    content = beginning(path)
    if isinstance(content, dict) and _key(content, _IMAGE[:1]) and not _key(content, _WORLD):
        raise InputError("wrong-axes", f"{path}: expected world landmarks, got {_IMAGE_REASON}.")
    if content is not None:
        clock = _json(path, sightings)
    elif peek(path, *_SHAPES) is not None:
        for frame, values in enumerate(plain_array(path, *_SHAPES)):
            _add(sightings, frame, values)
    else:
        clock = _table(path, sightings)
    if (off := _off_origin(sightings.points)) > _ROOT_M:
        raise InputError(
            "wrong-axes",
            f"{path}: expected world landmarks with the middle of the hips at the origin, got it {off:.2g} away; these "
            f"look like {_IMAGE_REASON}.",
        )
    people = sightings.poses(BLAZEPOSE33, CAMERA.with_(origin="camera"), clock)
    return tuple(poses.with_(frames_known=poses.frames_known and clock is not None) for poses in people)


def _add(
    sightings: People,
    moment: int,
    values: np.ndarray,
    person: str | None = None,
    box: np.ndarray | None = None,
) -> None:
    """values: (33, 3 or 4) of a person, who may be nobody."""
    joints, scores = values[:, :3], values[:, 3] if values.shape[1] == 4 else None
    if not ((joints == -1).all() or np.isnan(joints).all()):
        sightings.add(moment, joints, scores, person, box)


def _off_origin(joints: np.ndarray) -> float:
    """How far the middle of the hips is from the origin, the median over the frames (N, 33, 3) that have it."""
    hips = joints[:, _HIPS].mean(axis=1)
    hips = hips[np.isfinite(hips).all(axis=1)]
    return float(np.median(np.linalg.norm(hips, axis=1))) if len(hips) else 0.0


def _order(points: set[str] | tuple[str, ...]) -> list[str] | None:
    """The landmarks of a table in their order, by MediaPipe's names or by their numbers; None where one lacks."""
    return next((order for order in (_NAMES, [*map(str, range(COUNT))]) if {*order} <= {*points}), None)


def _table(path: Path, sightings: People) -> Clock:
    held = read_points(path, "a table of MediaPipe's 33 landmarks")
    order = _order(held.names)
    if order is None:
        raise InputError(
            "wrong-content",
            f"{path}: expected MediaPipe's 33 landmarks, with columns x, y, z (and visibility) of each in one row, or "
            f"a row a landmark with frame, landmark, x, y, z; got {', '.join(held.names[:8])}.",
        )
    values = held.values[:, [held.names.index(point) for point in order]]
    for moment, person, row in zip(held.moments.tolist(), held.people, values, strict=True):
        _add(sightings, moment, row, person)
    return held.clock


def _json(path: Path, sightings: People) -> Clock:
    """Everybody in the file; a frame without anybody counts."""
    moments, expected = Moments(str(path)), f"a frame with {' or '.join(_WORLD[:2])}"
    for moment, entry, where in frames(path, "MediaPipe's landmarks", expected, moments, _is_frame):
        if isinstance(entry, list) and entry and isinstance(entry[0], dict) and _key(entry[0], _WORLD):
            entry = {_WORLD[0]: [person[_key(person, _WORLD) or ""] for person in entry]}
        fields = entry if isinstance(entry, dict) else {}
        key, shown = _key(fields, (*_WORLD, *_IMAGE)), _key(fields, _IMAGE[:1])
        if key is not None and key == shown:
            raise InputError("wrong-axes", f"{path}: expected world landmarks, got {_IMAGE_REASON}.")
        boxes = [_box(values) for values in _people(fields[shown], where)] if shown else []
        people = _people(fields[key] if key else entry, where)
        for place, values in enumerate(people):
            _add(sightings, moment, values, box=boxes[place] if len(boxes) == len(people) else None)
    return moments.clock()


def _is_frame(key: str, entry: Any) -> bool:
    """Whether an entry of JSON, or what an object holds under its key, is a frame with landmarks or the landmarks."""
    if isinstance(entry, dict):
        return _key(entry, (*_WORLD, *_IMAGE)) is not None
    return isinstance(entry, list) or plain(key) in _WORLD


def _key(entry: Mapping[str, Any], names: tuple[str, ...]) -> str | None:
    """The first of the entry's keys that has one of these plain names."""
    by_name = {plain(key): key for key in entry}
    return next((by_name[name] for name in names if name in by_name), None)


def _are_landmarks(values: Any) -> bool:
    """Whether they are 33 points with x, y and z by name."""
    return (
        isinstance(values, list)
        and len(values) == COUNT
        and all(isinstance(point, dict) and point.keys() >= set(_AXES[:3]) for point in values)
    )


def _people(landmarks: Any, where: str) -> list[np.ndarray]:
    """(33, 4) of each person in one frame's landmarks, which may be those of one person or a list of people's."""
    if isinstance(landmarks, dict) and "landmark" in landmarks:  # as protobuf's MessageToDict names it
        landmarks = landmarks["landmark"]
    if not landmarks:
        return []
    first = landmarks[0] if isinstance(landmarks, list) else None
    several = isinstance(first, list) and len(first) > 0 and isinstance(first[0], list | dict)
    return [_values(person, where) for person in (landmarks if several else [landmarks])]


def _values(person: Any, where: str) -> np.ndarray:
    person = person if isinstance(person, list) else []
    values = numbers([by_name(point, "xyz") if isinstance(point, dict) else point for point in person], where)
    if values.ndim != 2 or len(values) != COUNT or values.shape[1] < 3:
        raise InputError(
            "wrong-content", f"{where}: expected x, y and z of {COUNT} landmarks, got shape {values.shape}."
        )
    return values[:, :4]


def _box(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values[:, :2].min(axis=0), values[:, :2].max(axis=0)])
