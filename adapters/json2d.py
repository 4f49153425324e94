"""2D keypoints in JSON of whoever wrote it: frames of people, each with keypoints in a known form (formats.md 5).

A list of detections (AlphaPose, COCO's results), of {frame, people: [...]} (MMPose's inferencer) or of lists of people
(Ultralytics' to_json), an object with such a list (MMPose's demos, COCO's annotations) or of images by their names
(AlphaPose's --format cmu and open), one person or frame a line, or a folder with a file a frame (OpenPose's
--write_json, Pose2Sim, Sports2D, MMPose over images). So do MoveNet and PoseNet of TF.js and ml5, OpenPifPaf,
EasyMocap's annots, rtmlib and others' own scripts.
Pixels; the layout is told by the number of joints. Frames count from 0; a frame without people has no row. Scores that
are all 0, 1 or 2 are COCO's flags of visibility: 0 means that the joint is missing, the others say nothing about
certainty.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import OPENPOSE18
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.json import (
    beginning,
    first_person,
    frame_files,
    keypoints_of,
    lists_images,
    name_of,
    people,
    surely_2d,
)
from .kit.people import People

name = "json2d"
gives = "keypoints"
general = True
reads = (
    "JSON of 2D keypoints, a file or a folder of frames: AlphaPose, OpenPose, MMPose, COCO, Ultralytics, TF.js, "
    "OpenPifPaf, EasyMocap, own scripts, pixels"
)

_BODIES = ("bodies", "people")  # of AlphaPose's --format cmu and open
_PIXELS = 5.0  # that joints lie apart, at least; shares of an image are within 1
_MOST_SCORE = 2.0  # and no third coordinate
_PIXEL = 1.0


def sniff(path: Path) -> bool:
    content = beginning(next(iter(frame_files(path)), path) if path.is_dir() else path)
    if path.is_dir() and isinstance(content, dict) and isinstance(content.get("people"), list):
        return True  # OpenPose's, though nobody may be there in the first frames
    if lists_images(content) or _by_image(content):
        return True
    first = first_person(path)
    if first is None:
        return False
    try:
        points, scores = keypoints_of(first[0], "")
    except InputError:
        return False
    places = points[(points != 0).any(axis=1)]
    in_pixels = len(places) > 1 and np.ptp(places) > _PIXELS and not (np.abs(scores) > _MOST_SCORE).any()
    return bool(surely_2d(first[0]) or in_pixels)


def read(path: Path, track: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the number that the file gives, or joined from frame to frame by nearness.

    frame_index is the frame or image that the file names, or the number in a name of an image or a file.
    track: ignore the numbers and join people by nearness all the same. Scores above 1 are clipped and counted in the
    history; scores that are all alike are unknown. Raises InputError when the file is of another form, in shares of the
    image or 3D, when images are of several videos, and when a person is in a frame twice because nobody was tracked.
    """
    content = beginning(path)
    by_image = _by_image(content)
    moments, sightings = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "2D keypoints in JSON", moments):
        points, scores = keypoints_of(person, where)
        if by_image:
            _refuse_head_as_neck(points, where)
        sightings.add(moment, points, scores, None if track else name_of(person))
    flags = sightings.without_flags()
    everybody = sightings.keypoints(moments.clock())
    return tuple(poses.noted("scores", unknown="visibility flags") if flags else poses for poses in everybody)


def _by_image(content: Any) -> bool:
    """Whether it is the dict of AlphaPose's --format cmu or open."""
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
