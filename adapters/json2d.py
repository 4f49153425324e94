"""2D keypoints in JSON of whoever wrote it: frames of people, each with keypoints in a spelling in use.

A list of {frame, people: [...]} or of lists of people, an object with such a list, or one person a line: MoveNet and
PoseNet of TF.js ({keypoints: [{x, y, score, name}]}), rtmlib's and others' own scripts ({keypoints: [[x, y, score]]}).
Pixels; the layout is told by the number of joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.pose import PoseSequence
from . import alphapose, coco, mmpose2d, ultralytics
from .kit.clock import Moments, first_of
from .kit.frames import first_person, keypoints_of, people
from .kit.people import People

name = "json2d"
gives = "keypoints"
reads = "other JSON of 2D keypoints: frames with people and their keypoints (TF.js, rtmlib's scripts), pixels"
marks = ("keypoints", "score")

_PIXELS = 5.0  # that joints lie apart, at least; shares of an image are within 1
_MOST_SCORE = 2.0  # and no third coordinate


def sniff(path: Path) -> bool:
    found = first_person(path)
    if (
        found is None
        or path.is_dir()
        or any(one.sniff(path) for one in (alphapose, coco, mmpose2d, ultralytics))
    ):
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
        found.add(moment, *keypoints_of(person, where), None if track else _name(person))
    return found.keypoints(moments.clock())


def _name(person: Mapping[str, Any]) -> str | None:
    key = first_of("person", [*person])
    name = None if key is None else [*person.values()][key]
    return None if name is None or isinstance(name, list | dict) or name == -1 else str(name)
