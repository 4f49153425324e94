"""COCO-style keypoints: a results list, or the dict of an annotation file (formats.md 6).

A result is {image_id, category_id, keypoints: x, y, v of every joint, score} with an integer image_id, or MotionBERT's
frame_id; OpenPose (--write_coco_json), Detectron and MMPose's evaluation write such lists. A list whose entries have
`idx`, or `box` or a text as image_id and no `track_id`, is AlphaPose's. An annotation dict is {images: [{id,
file_name}], annotations: [{image_id, keypoints, ...}], ...}; without images its annotations are results. `track_id` is
read where it is; a detection without one, in a file where others have it, is nobody's and left out.

v is a score in results. Where all of them are 0, 1 or 2 they are flags (not labelled, hidden, visible): 0
means that the joint is missing, the others say nothing about certainty, and the confidence is NaN.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..pipeline.core.errors import InputError
from ..pipeline.core.pose import PoseSequence
from .alphapose import is_alphaposes
from .kit.clock import Moments
from .kit.frames import first_person, keypoints_of, people
from .kit.json import beginning, entries, field, frame_number, load
from .kit.people import People

name = "coco"
gives = "keypoints"
reads = "COCO keypoint results (list) or annotations (dict) in JSON"
marks = ("image_id", "keypoints", "category_id")

_FRAMES = ("image_id", "frame_id")


def sniff(path: Path) -> bool:
    content = beginning(path)
    if _has(content, "images", "id", "file_name"):
        return True
    found = first_person(path)
    if found is None or not found[1] or "keypoints" not in found[0]:
        return False
    entry = found[0]
    return any(isinstance(entry.get(key), int | str) for key in _FRAMES) and not is_alphaposes(entry)


def _has(content: Any, key: str, *fields: str) -> bool:
    """Whether content[key] is a list whose first object has these fields."""
    listed = content.get(key) if isinstance(content, dict) else None
    first = listed[0] if isinstance(listed, list) and listed else None
    return isinstance(first, dict) and first.keys() >= set(fields)


def read(path: Path, track: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a person, named by `track_id`, or joined from frame to frame by nearness in a file without.

    frame_index is the image_id of results, and the number in the file_name of annotations.
    track: ignore `track_id` and join people by nearness all the same.
    Scores above 1 are clipped and counted in the history. Raises InputError when the file is neither form,
    when an image has no number, when images with people are of several videos (one number twice, or several folders),
    and when a track has two people in one frame.
    """
    moments, found = Moments(str(path)), People(str(path))
    content = beginning(path)
    listed = _annotations if isinstance(content, dict) and "images" in content else _results
    for moment, entry, where in listed(path, moments):
        person = None if track else entry.get("track_id")
        found.add(moment, *keypoints_of(entry, where), None if person is None else str(person))
    flags = found.without_flags()
    everybody = found.keypoints(moments.clock())
    return tuple(poses.noted("scores", unknown="visibility flags") if flags else poses for poses in everybody)


def _results(path: Path, moments: Moments) -> Iterator[tuple[int, Any, str]]:
    for moment, entry, where in people(path, "COCO keypoints", moments):
        if not isinstance(entry, dict) or "frame_id" not in entry:
            frame_number(field(entry, "image_id", where), where)
        yield moment, entry, where


def _annotations(path: Path, moments: Moments) -> Iterator[tuple[int, Any, str]]:
    """Moment, annotation and place in the file of each that has keypoints."""
    listed: dict[str, str] = {}  # names of images by their numbers
    images: dict[str, str] = {}  # and numbers by names, of those with people
    content = load(path, "COCO keypoints")
    for i, image in enumerate(entries(field(content, "images", str(path)), str(path))):
        here = f"{path}, image {i}"
        listed[str(field(image, "id", here))] = str(field(image, "file_name", here))
    for i, entry in enumerate(entries(field(content, "annotations", str(path)), str(path))):
        here = f"{path}, annotation {i}"
        image = field(entry, "image_id", here)
        if str(image) not in listed:
            raise InputError(
                "wrong-content", f"{here}: expected an image that the file lists, got {reprlib.repr(image)}."
            )
        if "keypoints" not in entry:
            continue
        name = listed[str(image)]
        if images.setdefault(name, str(image)) != str(image):
            raise InputError(
                "files-apart",
                f"{here}: expected the images of one video, each with a name of its own, got {name} beside {name} of "
                "another image; keep each video's keypoints in a file of their own.",
            )
        if (moment := moments.of({"file_name": name}, here)) is not None:
            yield moment, entry, here
