"""Detections that VideoPose3D's scripts write, one `<video>.npz` a video.

Arrays of Python objects, read without unpickling: `boxes` and `keypoints` hold [[], array] a frame, the array being
(people, 5) x1, y1, x2, y2, score and (people, 4, 17) rows x, y, logit, probability in COCO's order, or an empty list
when nobody was found (inference/infer_video_d2.py). Every frame of the video has an entry. Detectron does not follow
people: they are joined from frame to frame.
"""

from __future__ import annotations

import reprlib
from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import has_objects, shaped
from .kit.people import People
from .kit.pickles import load_objects

name = "detectron"
gives = "keypoints"
reads = "VideoPose3D's Detectron detections, <video>.npz of boxes and keypoints, COCO-17"

_X, _Y, _PROBABILITY = 0, 1, 3  # rows of a person; between them is a logit, 0 from Detectron 2


def sniff(path: Path) -> bool:
    return has_objects(path, "boxes", "keypoints", "metadata")


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by nearness; frame_index counts the video's frames from 0.

    A frame without people has no row. Raises InputError when the file is not of this form, or holds anything but
    arrays and plain containers.
    """
    sightings = People(str(path))
    frames = load_objects(path, "keypoints")
    for frame, classes in enumerate(frames if isinstance(frames, list) else [frames]):
        where = f"{path}, frame {frame}"
        if not isinstance(classes, list) or len(classes) != 2:
            raise InputError(
                "wrong-content", f"{where}: expected [[], keypoints], got {reprlib.repr(classes)}."
            )
        if not isinstance(classes[1], list) or classes[1]:
            for person in shaped(classes[1], where, ("people", 4, len(COCO17))):
                sightings.add(frame, person[[_X, _Y]].T, person[_PROBABILITY])
    return sightings.keypoints()
