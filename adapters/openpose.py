"""A folder of OpenPose's --write_json: one `<video>_<number>_keypoints.json` a frame (formats.md 6).

Each file holds {version, people: [{pose_keypoints_2d: x, y, score of every joint, ...}]}, BODY_25 or the 18
joints of the COCO model. Frames count from 0; a frame without people has a file with an empty list. OpenPose
writes 0, 0, 0 for a joint that it did not find, and does not follow people: they are joined frame by frame.
Scores are in [0, 1] (doc/02_output.md of OpenPose).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..pipeline.errors import InputError
from ..pipeline.layouts import BODY_25, OPENPOSE18
from ..pipeline.pose import PoseSequence
from ._json import beginning, entries, field, frame_number, load
from ._tracks import Detection, sequences, triples

name = "openpose"
gives = "keypoints"
reads = "folder of *_keypoints.json from OpenPose's --write_json, BODY_25 or COCO-18"

_ENDING = "_keypoints.json"
_DIGITS = "0123456789"


def sniff(path: Path) -> bool:
    first = next(_frame_files(path), None)
    content = beginning(first) if first else None
    return isinstance(content, dict) and isinstance(content.get("people"), list)


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by nearness; frame_index = number in the file's name.

    A frame without a person has no row. Raises InputError when the folder holds no such files or those of
    several videos, and when a file is not OpenPose's.
    """
    files = sorted(_frame_files(path))
    if not files:
        raise InputError(f"Expected a folder of OpenPose's *{_ENDING} files at {path}, found none there.")
    videos = sorted({file.name.removesuffix(_ENDING).rstrip(_DIGITS) for file in files})
    if len(videos) > 1:
        raise InputError(
            f"Expected the frames of one video in {path}, got those of {len(videos)}: {videos[0]}*, {videos[1]}*; "
            "give each video a folder of its own."
        )
    detections = []
    for file in files:
        frame = frame_number(file.name.removesuffix(_ENDING), str(file))
        people = field(load(file, "OpenPose's people of one frame"), "people", str(file))
        for person in entries(people, str(file)):
            points = triples(field(person, "pose_keypoints_2d", str(file)), str(file))
            detections.append(Detection(frame, points))
    return sequences(detections, (BODY_25, OPENPOSE18), str(path))


def _frame_files(path: Path) -> Iterator[Path]:
    return (file for file in path.glob(f"*{_ENDING}") if not file.name.startswith("."))
