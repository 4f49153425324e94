"""3D joints in JSON of frames and people: EasyMocap's folders of keypoints3d, Azure Kinect's bodies, ZED's bodies.

Their order is told by their number: OpenPose's 18 and 25, Azure Kinect's 32, ZED's 34 and 38. A fourth number of a
joint is its score. Nothing says which axis is up and which unit it is: the body shows it, as of tables (adapter
table3d), unless options say it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import BODY_25, OPENPOSE18, Layout
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.frames import KEYPOINTS_3D, first_person, name_of, people
from .kit.json import numbers
from .kit.names import joints_named
from .kit.people import People
from .kit.world import Maker, maker, standing_frame

name = "json3d"
gives = "poses"
reads = "JSON of 3D joints: EasyMocap's keypoints3d, Azure Kinect's and ZED's bodies, in a world or a camera"
marks = KEYPOINTS_3D


def _sided(*parts: str) -> tuple[str, ...]:
    return tuple(f"{side}_{part}" for side in ("left", "right") for part in parts)


_ARMS = _sided("clavicle", "shoulder", "elbow", "wrist", "hand", "handtip", "thumb")
_LEGS = _sided("hip", "knee", "ankle", "foot")
_FACE = ("head", "nose", "left_eye", "left_ear", "right_eye", "right_ear")
_PAIRS = ("eye", "ear", "clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "big_toe", "small_toe",
          "heel", "hand1", "hand2", "hand3", "hand4")  # fmt: skip
_ORDERS = {  # names of joints by their number
    len(OPENPOSE18): OPENPOSE18.joints,
    len(BODY_25): BODY_25.joints,
    32: ("pelvis", "spine", "chest", "neck", *_ARMS, *_LEGS, *_FACE),  # Azure Kinect
    34: (
        "pelvis",
        "spine",
        "chest",
        "neck",
        *_ARMS,
        *_LEGS,
        *_FACE,
        *_sided("heel"),
    ),  # ZED's BODY_34 and BODY_38
    38: (
        "pelvis",
        "spine",
        "spine2",
        "spine3",
        "neck",
        "nose",
        *(joint for part in _PAIRS for joint in _sided(part)),
    ),
}


def sniff(path: Path) -> bool:
    found = first_person(path)
    try:
        points = None if found is None else _points(found[0], "")
    except InputError:
        return False
    return points is not None and len(points) in _ORDERS


def read(
    path: Path,
    up: str | None = None,
    unit: str | None = None,
    track: bool = False,
    made_by: Maker | None = None,
) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the number that the file gives, or joined from frame to frame by nearness.

    up: "z" or "y", the axis of a world that is up, or "camera" for x right, y down, z away. unit: "m", "cm" or "mm".
    track: ignore the numbers of people. made_by: "measured" or "estimated", which the file does not say. InputError for
    other JSON, for other numbers of joints, and where neither the body nor an option tells the axes and the unit.
    """
    moments, found = Moments(str(path)), People(str(path))
    columns: dict[str, int] = {}
    for moment, person, where in people(path, "3D joints in JSON", moments):
        points = _points(person, where)
        columns = columns or _columns(len(points))
        if len(points) not in _ORDERS or len(points) <= max(columns.values()):
            raise InputError(
                "wrong-content",
                f"{where}: expected {', '.join(map(str, _ORDERS))} joints, as many throughout, got {len(points)}.",
            )
        points = points[list(columns.values())]
        found.add(moment, points[:, :3], points[:, 3], None if track else name_of(person, where))
    layout = Layout("JSON", tuple(columns))
    frame = standing_frame(found.points, layout, up, unit, str(path))
    return tuple(
        poses.with_(made_by=maker(made_by))
        for poses in found.poses(layout, frame, moments.clock(), placed=True)
    )


def _points(person: Any, where: str) -> np.ndarray:
    """(J, 4) x, y, z and score, NaN where missing or not said; InputError for anything else."""
    key = next((key for key in KEYPOINTS_3D if key in person), None) if isinstance(person, dict) else None
    if key is None:
        raise InputError(
            "wrong-content",
            f"{where}: expected a person with {' or '.join(KEYPOINTS_3D)}, got {person!r:.60}.",
        )
    values = numbers(person[key], where)
    if values.ndim != 2 or values.shape[1] not in (3, 4):
        raise InputError(
            "wrong-content", f"{where}: expected x, y, z of each joint in {key}, got shape {values.shape}."
        )
    points = np.full((len(values), 4), np.nan)
    points[:, : values.shape[1]] = values
    points[(points[:, :3] == 0).all(axis=1) | (points[:, 3] == 0)] = np.nan
    return points


def _columns(count: int) -> dict[str, int]:
    """Where each of our joints is among so many."""
    return joints_named(_ORDERS.get(count, ()))
