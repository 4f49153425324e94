"""COCO-style keypoints: a results list, or the dict of an annotation file (formats.md 6).

A result is {image_id, category_id, keypoints: x, y, v of every joint, score}, with COCO-17 or Halpe-26
joints and an integer image_id; OpenPose (--write_coco_json), Detectron and MMPose's evaluation write such
lists. A list whose entries have `idx`, or `box` or a text as image_id and no `track_id`, is AlphaPose's. An annotation
dict is {images: [{id, file_name}], annotations: [{image_id, keypoints, ...}], ...}. `track_id` is read where it is; a
detection without one, in a file where others have it, is nobody's and left out.

v is a score in results. Where all of them are 0, 1 or 2 they are flags (not labelled, hidden, visible): 0
means that the joint is missing, the others say nothing about certainty, and the confidence is NaN.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17, HALPE26
from ..pipeline.core.pose import PoseSequence
from .alphapose import is_alphaposes
from .kit.json import Images, beginning, each, entries, field, first_detection, load
from .kit.tracks import Detection, counted, sequences, triples

name = "coco"
gives = "keypoints"
reads = "COCO keypoint results (list) or annotations (dict) in JSON, COCO-17 or Halpe-26"

_FLAGS = (0, 1, 2)
_LAYOUTS = (COCO17, HALPE26)


def sniff(path: Path) -> bool:
    content = beginning(path)
    entry = first_detection(content)
    if entry is not None:
        return isinstance(entry["image_id"], int | str) and not is_alphaposes(entry)
    return _has(content, "images", "id", "file_name") or _has(content, "annotations", "image_id", "keypoints")


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
    what, where = "COCO keypoints", str(path)
    if isinstance(beginning(path), list):
        found = _results((entry for _, entry in each(path, what)), where)
    else:
        content = load(path, what)
        found = (
            _annotations(content, where)
            if isinstance(content, dict)
            else _results(entries(content, where), where)
        )
    detections = counted((_detection(entry, frame, track, here) for entry, frame, here in found), where)
    flags = all(np.isin(one.points[:, 2], _FLAGS).all() for one in detections)
    if not flags:
        return sequences(detections, _LAYOUTS, where)
    people = sequences([_without_flags(one) for one in detections], _LAYOUTS, where)
    return tuple(poses.noted("scores", unknown="visibility flags") for poses in people)


def _results(listed: Iterable[Any], where: str) -> Iterator[tuple[Any, int, str]]:
    """Each entry with its frame and its place in the file."""
    images = Images()
    for i, entry in enumerate(listed):
        here = f"{where}, entry {i}"
        yield entry, images.number(field(entry, "image_id", here), here), here


def _annotations(content: dict[str, Any], where: str) -> Iterator[tuple[Any, int, str]]:
    """Each annotation that has keypoints, with its frame and its place in the file."""
    listed: dict[str, tuple[Any, str]] = {}  # name and place of each image
    for i, image in enumerate(entries(field(content, "images", where), where)):
        here = f"{where}, image {i}"
        listed[str(field(image, "id", here))] = field(image, "file_name", here), here
    images = Images()
    for i, entry in enumerate(entries(field(content, "annotations", where), where)):
        here = f"{where}, annotation {i}"
        image = field(entry, "image_id", here)
        if str(image) not in listed:
            raise InputError(
                "wrong-content", f"{here}: expected an image that the file lists, got {reprlib.repr(image)}."
            )
        if "keypoints" in entry:
            yield entry, images.number(*listed[str(image)], identity=str(image)), here


def _detection(entry: Any, frame: int, track: bool, where: str) -> Detection:
    person = None if track else entry.get("track_id")
    points = triples(field(entry, "keypoints", where), where)
    return Detection(frame, points, None if person is None else str(person))


def _without_flags(detection: Detection) -> Detection:
    labelled = detection.points[:, 2:] > 0
    points = np.where(labelled, detection.points, np.nan)
    points[:, 2] = np.nan
    return Detection(detection.frame, points, detection.person)
