"""The JSON of MMPose 1.x 3D scripts: frames of instances, keypoints of x, y, z (formats.md 3 and 4).

The inferencer writes a list of {frame_id, instances}, frames from 0; the demos write {meta_info, instance_info:
[{frame_id, instances}]}, frames from 1. An instance is {keypoints: [[x, y, z], ...], keypoint_scores, bbox,
bbox_score}, the bbox sometimes inside one more list, or missing. Of images, the inferencer writes a folder with a JSON
each, named like the image, which is the list of its instances (base_mmpose_inferencer.py, postprocess); `predictions`
is the folder that its --out-dir makes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import Layout
from ...pipeline.core.notices import notice
from ...pipeline.core.pose import PoseSequence
from .json import beginning, each, entries, field, frame_number, load, numbers
from .people import Bodies

_REBASED = 0.95  # share of bodies whose lowest joint is at height 0


def first_keypoints(path: Path) -> Any:
    """The keypoints of the first person in the beginning of the file, or in a folder's files; None when it is not of
    this form. Never raises."""
    if path.is_dir():
        for image in images(path):
            people = beginning(image)
            if not isinstance(people, list) or not all(map(_is_instance, people)):
                return None
            if people:
                return people[0]["keypoints"]
        return None
    content = beginning(path)
    frames = content.get("instance_info") if isinstance(content, dict) else content
    if not isinstance(frames, list):
        return None
    for frame in frames:
        if not isinstance(frame, dict) or "frame_id" not in frame:
            return None
        people = frame.get("instances")
        person = people[0] if isinstance(people, list) and people else None
        keypoints = person.get("keypoints") if isinstance(person, dict) else None
        if keypoints is not None:
            return keypoints
    return None


def images(path: Path) -> list[Path]:
    """The files of a folder that holds one JSON an image, or of its `predictions`."""
    folder = path / "predictions" if (path / "predictions").is_dir() else path
    return sorted(folder.glob("*.json"))


def _is_instance(entry: Any) -> bool:
    return isinstance(entry, dict) and "keypoints" in entry and "image_id" not in entry


def frames(
    path: Path, what: str, check_meta: Callable[[Any, str], None] = lambda meta, where: None
) -> Iterator[tuple[int, list[Any], str]]:
    """Of each frame in a file, or each image of a folder: its number, its instances, and how errors name it.

    Numbers count from 0, those of a folder as the images' names do. what: the file in words, for errors. check_meta:
    called with a demo's meta_info. InputError when it is not of this form.
    """
    if path.is_dir():
        yield from _image_frames(path, what)
        return
    count = 0
    for key, entry in each(path, what):
        if key == "meta_info":
            check_meta(entry, str(path))
        if key not in ("", "instance_info"):
            continue
        here = f"{path}, entry {count}"
        count += 1
        frame = frame_number(field(entry, "frame_id", here), here) - (key == "instance_info")
        if frame < 0:
            raise InputError(
                "times-broken", f"{here}: expected frames from 1, as MMPose's demos count, got frame 0."
            )
        yield frame, entries(field(entry, "instances", here), here), here
    if not count:
        raise InputError(
            "format-unknown", f"{path}: expected a list of frames, or an object with 'instance_info'."
        )


def _image_frames(path: Path, what: str) -> Iterator[tuple[int, list[Any], str]]:
    numbered: dict[int, Path] = {}
    for image in images(path):
        number = frame_number(image.name, str(image))
        other = numbered.setdefault(number, image)
        if other != image:
            raise InputError(
                "files-apart",
                f"{path}: expected one image of each number, got {other.name} and {image.name}; keep each video's "
                "images in a folder of their own.",
            )
    if not numbered:
        raise InputError("cannot-open", f"Expected {what} in {path}, found no JSON there.")
    for number, image in sorted(numbered.items()):
        yield number, entries(load(image, what), str(image)), str(image)


def recognised(path: Path, count: int) -> bool:
    """Whether the first person in the file has `count` keypoints of three numbers."""
    keypoints = first_keypoints(path)
    return (
        isinstance(keypoints, list)
        and len(keypoints) == count
        and all(isinstance(point, list) and len(point) == 3 for point in keypoints)
    )


def bodies(path: Path, what: str, count: int, layout: Layout) -> Bodies:
    """Everybody in the file; of `count` keypoints the first ones, which are those of the layout.

    path, what: of `frames`. InputError when the file is not of this form, is 2D,
    or has another number of keypoints.
    """
    found = Bodies(layout)
    for frame, people, here in frames(path, what):
        for person in people:
            joints, scores = _joints(person, count, here), _scores(person, count, here)
            found.add(frame, joints[: len(layout)], scores[: len(layout)], _box(person, here))
    return found


def _joints(person: Any, count: int, where: str) -> np.ndarray:
    joints = numbers(field(person, "keypoints", where), where)
    if joints.ndim == 2 and joints.shape[1] == 2:
        raise InputError(
            "format-unknown",
            f"{where}: expected 3D keypoints, got two coordinates each; adapter mmpose2d reads MMPose's 2D results.",
        )
    if joints.shape != (count, 3):
        raise InputError(
            "wrong-content",
            f"{where}: expected {count} keypoints of x, y, z, got shape {joints.shape}; adapter mmpose3d reads 17 of "
            "them (lifters), adapter rtmw3d 133 (RTMW3D).",
        )
    return joints


def _scores(person: Any, count: int, where: str) -> np.ndarray:
    scores = numbers(field(person, "keypoint_scores", where), where)
    if scores.shape != (count,):
        raise InputError(
            "wrong-content", f"{where}: expected a score of each of {count} joints, got shape {scores.shape}."
        )
    return scores


def _box(person: dict[str, Any], where: str) -> np.ndarray | None:
    box = numbers(person.get("bbox", []), where).ravel()
    return box if box.shape == (4,) else None


def rebase_said(poses: PoseSequence) -> PoseSequence:
    """The same with a notice when each frame's lowest joint was put at height (third axis) 0."""
    heights = poses.joints[..., 2]
    rebased = int((np.fmin.reduce(heights, axis=1) == 0).sum())
    if rebased < _REBASED * len(poses):
        return poses
    lowest = np.argmax(heights == 0, axis=1)
    changes = int((np.diff(lowest) != 0).sum())
    said = notice("rebased-to-floor", rebased=rebased, frames=len(poses), changes=changes)
    return poses.noted("rebase", frames=rebased).saying(said)
