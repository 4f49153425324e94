"""MediaPipe Pose's world landmarks, as people save them: CSV or JSON, for there is no official writer (formats.md 5).

A table has x, y, z (and visibility) of 33 landmarks in one row a frame, with or without a header, or one row a
landmark. JSON is a list of frames, or an object that holds one, and a frame has `pose_world_landmarks` (or
`world_landmarks`, `pose_world`, `poseWorldLandmarks`) of one person or of several, or is the 33 landmarks itself.

World landmarks are metres in camera axes (z negative towards the camera), the middle of the hips at the origin of
every frame, so that the body does not move through space. Image landmarks are shares of the image's width and
height with a z that is no length: they are recognised and refused. Visibility is MediaPipe's own likelihood that a
landmark is visible. A selfie video is often mirrored before MediaPipe sees it: left and right are then
exchanged in a way that nothing in the file shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import BLAZEPOSE33
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.json import beginning, each, frame_number, numbers
from .kit.landmarks import COUNT, Body, is_table, seconds, table
from .kit.people import Bodies

name = "mediapipe"
gives = "poses"
made_by = MadeBy("estimated", "MediaPipe")
reads = "MediaPipe Pose world landmarks in CSV or JSON, metres; image landmarks are refused"

_WORLD = ("pose_world_landmarks", "world_landmarks", "pose_world", "poseWorldLandmarks", "worldLandmarks")
_IMAGE = ("pose_landmarks", "poseLandmarks", "landmarks")
_FRAMES = ("frame", "frame_id", "frame_index", "frame_idx", "frame_number")
_AXES = ("x", "y", "z", "visibility")
_ROOT_M = 0.1  # the hips' middle is at the origin but for rounding
_HIPS = BLAZEPOSE33.indices(["l_hip", "r_hip"])
_IMAGE_REASON = (
    "image landmarks, whose x and y are shares of the image's width and height and whose z is not a length; save "
    "pose_world_landmarks instead of pose_landmarks"
)


def sniff(path: Path) -> bool:
    """Whether the file has MediaPipe's landmarks, of the world or of the image, which `read` refuses."""
    content = beginning(path)
    if content is None:
        return is_table(path)
    if isinstance(content, dict):
        if _key(content, _WORLD):
            return True
        content = next((value for value in content.values() if isinstance(value, list) and value), None)
    for frame in content if isinstance(content, list) else ():
        if isinstance(frame, dict):
            return bool(_key(frame, (*_WORLD, *_IMAGE[:2])))
        if frame:
            return isinstance(frame, list) and len(frame) == COUNT and all(map(_is_named_point, frame))
    return False


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame: BLAZEPOSE33 in camera axes, metres.

    Frame numbers and times are those of the file, if it has them; with times alone the numbers are counted by these, so
    that frames which were dropped leave a gap. A column whose unit its name does not say, such as
    `timestamp`, is not taken for a time. A frame whose numbers are all -1, as some write for nobody, or all missing
    has no row, but counts. Raises InputError for image landmarks and for files of another form.
    """
    found, frames_known, times = Bodies(BLAZEPOSE33), True, {}
    at, last = -1, None
    for body in _json(path) if beginning(path) is not None else table(path):
        when = (body.frame, body.time_s)
        at += when != last or when == (None, None)
        last = when
        frames_known &= body.frame is not None
        joints = body.values[:, :3]
        frame = at if body.frame is None else body.frame
        if body.time_s is not None:
            times[frame] = body.time_s
        if (joints == -1).all() or np.isnan(joints).all():
            continue
        found.add(frame, joints, body.values[:, 3], body.box)
    _check_world(found.joints, path)
    people = found.sequences(CAMERA.with_(origin="camera"), str(path))
    numbers = {} if frames_known or len(times) != at + 1 else _numbers(times)
    return tuple(_timed(poses.with_(frames_known=frames_known), times, numbers) for poses in people)


def _numbers(times: dict[int, float]) -> dict[int, int]:
    """Frame numbers, counted from 0, of frames that were counted, by their times: a step of about n usual ones is n
    frames. {} for times that do not increase."""
    steps = np.diff(list(times.values()))
    if len(steps) == 0 or not (steps > 0).all():
        return {}
    # The median is of rounded times (33, 33, 34 ms), which over a long gap would miss frames; the mean is not.
    median = np.percentile(steps, 50, method="lower")  # one of the steps, where two kinds of them alternate
    usual = steps[np.rint(steps / median) == 1].mean()
    counted = np.cumsum([0, *np.fmax(np.rint(steps / usual), 1)])
    return dict(zip(times, counted.astype(int).tolist(), strict=True))


def _timed(poses: PoseSequence, times: dict[int, float], numbers: dict[int, int]) -> PoseSequence:
    """The poses with the times of their frames, and with other numbers of these where there are any."""
    frames = poses.frame_index.tolist()
    stamps = [times.get(frame) for frame in frames]
    if None in stamps:
        return poses
    return poses.with_(
        time_s=np.array(stamps, dtype=np.float64),
        frame_index=np.array([numbers.get(frame, frame) for frame in frames]),
        frames_known=poses.frames_known,
    )


def _check_world(joints: np.ndarray, path: Path) -> None:
    hips = joints[:, _HIPS].mean(axis=1)
    hips = hips[np.isfinite(hips).all(axis=1)]
    if len(hips) and np.median(np.linalg.norm(hips, axis=1)) > _ROOT_M:
        place = ", ".join(f"{value:.2g}" for value in np.median(hips, axis=0))
        raise InputError(
            "wrong-axes",
            f"{path}: expected world landmarks with the middle of the hips at the origin, got it at ({place}); these "
            f"look like {_IMAGE_REASON}.",
        )


def _json(path: Path) -> Iterator[Body]:
    """Everybody in the file, and one of NaN for a frame without anybody; several people of a frame share its number,
    which is counted where none is said."""
    count = 0
    for i, (key, entry) in enumerate(each(path, "MediaPipe's landmarks")):
        where = f"{path}, entry {i}"
        if key in _IMAGE[:2]:
            raise InputError("wrong-axes", f"{path}: expected world landmarks, got {_IMAGE_REASON}.")
        if key in _WORLD or isinstance(entry, list):
            landmarks, frame, time_s, boxes = entry, None, None, []
        elif isinstance(entry, dict) and (found := _key(entry, (*_WORLD, *_IMAGE))):
            if found in _IMAGE[:2]:
                raise InputError("wrong-axes", f"{path}: expected world landmarks, got {_IMAGE_REASON}.")
            landmarks = entry[found]
            number = next((entry[name] for name in _FRAMES if name in entry), None)
            frame = None if number is None else frame_number(number, where)
            stamps = (seconds(name, value) for name, value in entry.items() if isinstance(value, int | float))
            time_s = next((stamp for stamp in stamps if stamp is not None), None)
            image = _key(entry, _IMAGE[:2])
            boxes = [_box(values) for values in _people(entry[image], where)] if image else []
        elif key and not isinstance(entry, dict):
            continue  # what else an object tells beside its list of frames
        else:
            raise InputError("wrong-content", f"{where}: expected a frame with {' or '.join(_WORLD[:2])}.")
        people = _people(landmarks, where)
        if frame is None and len(people) > 1:
            raise InputError(
                "wrong-content",
                f"{where}: expected frames with a number ('frame') if there are several people.",
            )
        if not people:  # counts as a table's empty row does, so that later frames keep their places and times
            yield Body(np.full((COUNT, 4), np.nan), frame, time_s)
        for place, values in enumerate(people):
            yield Body(values, frame, time_s, boxes[place] if len(boxes) == len(people) else None)
        count += 1
    if not count:
        raise InputError("nothing-usable", f"{path}: expected frames of MediaPipe's landmarks, found none.")


def _key(entry: dict[str, Any], names: tuple[str, ...]) -> str | None:
    return next((name for name in names if name in entry), None)


def _is_named_point(point: Any) -> bool:
    return isinstance(point, dict) and point.keys() >= set(_AXES[:3])


def _people(landmarks: Any, where: str) -> list[np.ndarray]:
    """(33, 4) of each person in one frame's landmarks, which may be those of one person or a list of people's."""
    if isinstance(landmarks, dict) and "landmark" in landmarks:  # as protobuf's MessageToDict names it
        landmarks = landmarks["landmark"]
    if not landmarks:
        return []
    if not isinstance(landmarks, list):
        raise InputError("wrong-content", f"{where}: expected a list of {COUNT} landmarks.")
    first = landmarks[0]
    several = isinstance(first, list) and len(first) > 0 and isinstance(first[0], list | dict)
    return [_values(person, where) for person in (landmarks if several else [landmarks])]


def _values(person: Any, where: str) -> np.ndarray:
    if not isinstance(person, list) or len(person) != COUNT:
        count = len(person) if isinstance(person, list) else "none"
        raise InputError("wrong-content", f"{where}: expected {COUNT} landmarks, got {count}.")
    rows = [[point.get(axis) for axis in _AXES] if isinstance(point, dict) else point for point in person]
    values = numbers(rows, where)
    if values.ndim != 2 or values.shape[1] < 3:
        raise InputError(
            "wrong-content", f"{where}: expected x, y and z of each landmark, got shape {values.shape}."
        )
    filled = np.full((COUNT, 4), np.nan)
    filled[:, : min(4, values.shape[1])] = values[:, :4]
    return filled


def _box(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values[:, :2].min(axis=0), values[:, :2].max(axis=0)])
