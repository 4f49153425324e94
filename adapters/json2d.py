"""2D keypoints in JSON of whoever wrote it: frames of people, each with keypoints in a spelling in use.

A list of {frame, people: [...]} or of lists of people, an object with such a list, one person or frame a line, or a
folder with a file a frame: MoveNet and PoseNet of TF.js and ml5 ({keypoints: [{x, y, score, name}]}), OpenPifPaf,
EasyMocap's annots, rtmlib's and others' own scripts ({keypoints: [[x, y, score]]}).
Pixels; the layout is told by the number of joints.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.pose import PoseSequence
from . import alphapose, coco, mmpose2d, openpose, ultralytics
from .kit.clock import Moments
from .kit.frames import first_person, keypoints_of, name_of, people
from .kit.people import People

name = "json2d"
gives = "keypoints"
general = True
reads = "other JSON of 2D keypoints, a file or a folder of frames: TF.js, OpenPifPaf, EasyMocap, own scripts, pixels"
marks = ("keypoints", "score")

_PIXELS = 5.0  # that joints lie apart, at least; shares of an image are within 1
_MOST_SCORE = 2.0  # and no third coordinate


def sniff(path: Path) -> bool:
    found = first_person(path)
    others = (alphapose, coco, mmpose2d, openpose, ultralytics)
    if found is None or any(other.sniff(path) for other in others):
        return False
    try:
        points, scores = keypoints_of(found[0], "")
    except InputError:
        return False
    places = points[(points != 0).any(axis=1)]
    return len(places) > 1 and bool(np.ptp(places) > _PIXELS and not (np.abs(scores) > _MOST_SCORE).any())


def read(path: Path, track: bool = False) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the number that the file gives, or joined from frame to frame by nearness.

    track: ignore the numbers and join people by nearness all the same. Raises InputError when the file is of another
    form, or in shares of the image.
    """
    moments, found = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "2D keypoints in JSON", moments):
        found.add(moment, *keypoints_of(person, where), None if track else name_of(person))
    return found.keypoints(moments.clock())
