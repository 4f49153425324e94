"""AlphaPose's alphapose-results.json: the default list, or the dict of --format cmu and open (formats.md 6).

The list holds one entry a detection, {image_id: "12.jpg", category_id, keypoints: x, y, score of every
joint, score, box, idx}, of COCO-17 or Halpe-26. AlphaPose names a video's frames from "0.jpg" on; names are
sorted by number, not as text. `idx` is the person only where AlphaPose tracked (--pose_track): without
tracking everybody is 0, and after non-maximum suppression it may be a list of lists. A list with
`track_id` and without `idx` is somebody else's (adapter coco). The dict is keyed by image name and holds the 18
joints of OpenPose's COCO model, without `idx`. Joint scores are heatmap maxima.
"""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17, HALPE26, OPENPOSE18
from ..pipeline.core.pose import PoseSequence
from .kit.json import Images, beginning, each, entries, field, first_detection, load, numbers
from .kit.tracks import Detection, sequences, triples

name = "alphapose"
gives = "keypoints"
reads = "alphapose-results.json of AlphaPose: COCO-17 or Halpe-26 list, or --format cmu / open"

_BODIES = {"bodies": "joints", "people": "pose_keypoints_2d"}  # --format cmu, --format open
_PIXEL = 1.0


def sniff(path: Path) -> bool:
    content = beginning(path)
    entry = first_detection(content)
    if entry is not None:
        return is_alphaposes(entry)
    return _bodies_key(content) is not None


def is_alphaposes(entry: dict[str, Any]) -> bool:
    """Whether a detection in a flat list has the fields by which AlphaPose's differ from COCO's."""
    named = isinstance(entry["image_id"], str) or "box" in entry
    return "idx" in entry or (named and "track_id" not in entry)


def read(path: Path, track: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a tracked person, named by its `idx` ("0" in a file without); frame_index = image number.

    track: ignore `idx` and join each detection to the nearest of the frames before.
    Scores above 1 are clipped and counted in the history. Raises InputError when the file is not AlphaPose's,
    when an image has no number, when images are of several videos (one number twice, or several folders), and when a
    person is in a frame twice because nobody was tracked.
    """
    what, start = "AlphaPose results", beginning(path)
    if not isinstance(start, list | dict):
        start = load(path, what)  # says what is wrong with it
    key = _bodies_key(start)
    if key is not None:
        found, layouts = _from_dict(each(path, what), key, track, path), (OPENPOSE18,)
    else:
        entries(start, str(path))
        listed, images = enumerate(each(path, what)), Images()
        found = (_from_entry(entry, images, track, f"{path}, entry {i}") for i, (_, entry) in listed)
        layouts = (COCO17, HALPE26)
    return sequences(found, layouts, str(path))


def _from_entry(entry: Any, images: Images, track: bool, where: str) -> Detection:
    image = field(entry, "image_id", where)
    if "track_id" in entry and "idx" not in entry:
        raise InputError(
            "format-unknown",
            f"{where}: expected a person's idx, as AlphaPose calls it, got a track_id, which adapter coco reads (--set "
            "read.keypoints_adapter=coco).",
        )
    return Detection(
        frame=images.number(image, where),
        points=triples(field(entry, "keypoints", where), where),
        person=None if track else track_named(entry.get("idx", 0), where),
    )


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


def _bodies_key(content: Any) -> str | None:
    """ "bodies" for the dict of --format cmu, "people" for that of --format open, None for anything else."""
    first = next(iter(content.values()), None) if isinstance(content, dict) else None
    return next(
        (key for key in _BODIES if isinstance(first, dict) and isinstance(first.get(key), list)), None
    )


def _from_dict(listed: Iterable[tuple[str, Any]], key: str, track: bool, path: Path) -> Iterator[Detection]:
    images = Images()
    for image, content in listed:
        where = f"{path}, image {image}"
        frame = images.number(image, where)
        for body in entries(field(content, key, where), where):
            points = triples(field(body, _BODIES[key], where), where)
            _refuse_head_as_neck(points, where)
            yield Detection(frame, points, None if track else "0")


def _refuse_head_as_neck(points: np.ndarray, where: str) -> None:
    """AlphaPose's writer appends the mid-shoulders and then takes entry 17 for them, which is Halpe's head
    (`write_json` in alphapose/utils/pPose_nms.py): with a Halpe model the "neck" of these formats is the head.
    """
    if len(points) != len(OPENPOSE18):
        return
    shoulders = points[OPENPOSE18.indices(["l_shoulder", "r_shoulder"]), :2].mean(axis=0)
    if np.abs(points[OPENPOSE18.index("neck"), :2] - shoulders).max() > _PIXEL:
        raise InputError(
            "wrong-content",
            f"{where}: expected the neck between the shoulders, where AlphaPose puts it with COCO models; with Halpe "
            "models --format writes the top of the head instead, so run AlphaPose again without --format.",
        )
