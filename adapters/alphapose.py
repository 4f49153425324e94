"""AlphaPose's alphapose-results.json: the default list, or the dict of --format cmu and open (formats.md 6).

The list holds one entry a detection, {image_id: "12.jpg", category_id, keypoints: x, y, score of every
joint, score, box, idx}, of COCO-17, Halpe-26 or a whole-body model. AlphaPose names a video's frames from "0.jpg" on;
names are sorted by number, not as text. `idx` is the person only where AlphaPose tracked (--pose_track): without
tracking everybody is 0, and after non-maximum suppression it may be a list of lists. A list with
`track_id` and without `idx` is somebody else's (adapter coco). The dict is keyed by image name and holds the 18
joints of OpenPose's COCO model, without `idx`. Joint scores are heatmap maxima.
"""

from __future__ import annotations

import reprlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import OPENPOSE18
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.frames import first_person, keypoints_of, people
from .kit.json import beginning, field, frame_number, numbers
from .kit.people import People

name = "alphapose"
gives = "keypoints"
reads = "alphapose-results.json of AlphaPose: list of 17, 26 or 136 joints, or --format cmu / open"
marks = ("image_id", "keypoints", "box", "idx")

_BODIES = {"bodies", "people"}  # --format cmu, --format open
_PIXEL = 1.0


def sniff(path: Path) -> bool:
    found = first_person(path)
    if found is not None and found[1]:
        return is_alphaposes(found[0])
    return _by_image(beginning(path))


def is_alphaposes(entry: Mapping[str, Any]) -> bool:
    """Whether a detection in a flat list has the fields by which AlphaPose's differ from COCO's."""
    if "image_id" not in entry:
        return False
    named = isinstance(entry["image_id"], str) or "box" in entry
    return "idx" in entry or (named and "track_id" not in entry)


def read(path: Path, track: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a tracked person, named by its `idx` ("0" in a file without); frame_index = image number.

    track: ignore `idx` and join each detection to the nearest of the frames before.
    Scores above 1 are clipped and counted in the history. Raises InputError when the file is not AlphaPose's,
    when an image has no number, when images are of several videos (one number twice, or several folders), and when a
    person is in a frame twice because nobody was tracked.
    """
    moments, found, by_image = Moments(str(path)), People(str(path)), _by_image(beginning(path))
    for moment, person, where in people(path, "AlphaPose results", moments):
        points, scores = keypoints_of(person, where)
        if "track_id" in person and "idx" not in person:
            raise InputError(
                "format-unknown",
                f"{where}: expected a person's idx, as AlphaPose calls it, got a track_id, which adapter coco reads "
                "(--set read.keypoints_adapter=coco).",
            )
        if by_image:
            _refuse_head_as_neck(points, where)
        else:
            frame_number(field(person, "image_id", where), where)
        found.add(moment, points, scores, None if track else track_named(person.get("idx", 0), where))
    return found.keypoints(moments.clock())


def track_named(idx: Any, where: str) -> str:
    """The track that `idx` names: a number, or nested lists of one and the same number. InputError for others."""
    if type(idx) is int and abs(idx) < 1 << 53:  # as nearly always, and an array of one number takes its time
        return str(idx)
    ids = numbers(idx, where).ravel()
    if len(ids) == 0 or not (ids == ids[0]).all() or ids[0] % 1 != 0:
        raise InputError(
            "people-mixed",
            f"{where}: expected one track number as idx, got {reprlib.repr(idx)}; pass track=true "
            "(--set keypoints.track=true) to ignore idx and join people to the nearest of the frames before.",
        )
    return f"{ids[0]:.0f}"


def _by_image(content: Any) -> bool:
    """Whether it is the dict of --format cmu or open."""
    first = next(iter(content.values()), None) if isinstance(content, dict) else None
    return isinstance(first, dict) and any(isinstance(first.get(key), list) for key in _BODIES)


def _refuse_head_as_neck(points: np.ndarray, where: str) -> None:
    """AlphaPose's writer appends the mid-shoulders and then takes entry 17 for them, which is Halpe's head
    (`write_json` in alphapose/utils/pPose_nms.py): with a Halpe model the "neck" of these formats is the head.
    """
    if len(points) != len(OPENPOSE18):
        return
    shoulders = points[OPENPOSE18.indices(["l_shoulder", "r_shoulder"])].mean(axis=0)
    if np.abs(points[OPENPOSE18.index("neck")] - shoulders).max() > _PIXEL:
        raise InputError(
            "wrong-content",
            f"{where}: expected the neck between the shoulders, where AlphaPose puts it with COCO models; with Halpe "
            "models --format writes the top of the head instead, so run AlphaPose again without --format.",
        )
