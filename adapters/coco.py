"""COCO-style keypoints: a results list, or the dict of an annotation file (formats.md 6).

A result is {image_id, category_id, keypoints: x, y, v of every joint, score}, with COCO-17 or Halpe-26
joints and an integer image_id; OpenPose (--write_coco_json), Detectron and MMPose's evaluation write such
lists. A list whose entries have `idx`, `box` or a text as image_id is AlphaPose's. An annotation dict is
{images: [{id, file_name}], annotations: [{image_id, keypoints, ...}], ...}. `track_id` is read where it is.

v is a score in results. Where all of them are 0, 1 or 2 they are flags (not labelled, hidden, visible): 0
means that the joint is missing, the others say nothing about certainty, and the confidence is NaN.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.layouts import COCO17, HALPE26
from ..pipeline.pose import PoseSequence
from ._json import beginning, entries, field, frame_number, load
from ._tracks import Detection, sequences, triples

name = "coco"
gives = "keypoints"
reads = "COCO keypoint results (list) or annotations (dict) in JSON, COCO-17 or Halpe-26"

_FLAGS = (0, 1, 2)


def sniff(path: Path) -> bool:
    content = beginning(path)
    if isinstance(content, list):
        entry = content[0] if content else None
        return (
            isinstance(entry, dict)
            and {"image_id", "keypoints"} <= entry.keys()
            and isinstance(entry["image_id"], int)
            and entry.keys().isdisjoint(("idx", "box"))
        )
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
    Scores above 1 (Detectron's are logits) are clipped and counted in the history. Raises InputError when the
    file is neither form, when an image has no number, and when a track has two people in one frame.
    """
    content = load(path, "COCO keypoints")
    if isinstance(content, dict):
        frames = _frames(content, str(path))
        key, listed = "annotation", entries(field(content, "annotations", str(path)), str(path))
        listed = [entry for entry in listed if not isinstance(entry, dict) or "keypoints" in entry]
    else:
        frames = None
        key, listed = "entry", entries(content, str(path))
    detections = [_detection(entry, frames, track, f"{path}, {key} {i}") for i, entry in enumerate(listed)]
    flags = all(np.isin(one.points[:, 2], _FLAGS).all() for one in detections)
    if not flags:
        return sequences(detections, (COCO17, HALPE26), str(path))
    people = sequences([_unflagged(one) for one in detections], (COCO17, HALPE26), str(path))
    return tuple(poses.noted("scores", unknown="the file has visibility flags") for poses in people)


def _frames(content: dict[str, Any], where: str) -> dict[Any, int]:
    """Frame number by image id."""
    images = entries(field(content, "images", where), where)
    return {
        field(image, "id", f"{where}, image {i}"): frame_number(
            field(image, "file_name", f"{where}, image {i}"), f"{where}, image {i}"
        )
        for i, image in enumerate(images)
    }
