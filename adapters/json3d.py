"""3D joints in JSON of frames and people: EasyMocap's folders of keypoints3d, Azure Kinect's bodies, ZED's bodies, and
OpenPose's 3D reconstruction (--3d --write_json, formats.md 5).

Their order is told by their number: OpenPose's 18 and 25, Azure Kinect's 32, ZED's 34 and 38; BODY_25 and BODY_25B are
told apart by the bones of all bodies. A fourth number of a joint is its score; a joint at 0, 0, 0 was not found.
Nothing says which axis is up and which unit it is: the body shows it, as of tables (adapter table3d), unless options
say it. OpenPose's axes are those of the camera that the calibration took for the origin, x right, y down, z where it
looks, in metres (its doc/advanced/calibration_module.md); files of its 2D runs hold the field too, empty.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import BODY_25, BODY_25B, OPENPOSE18, Layout
from ..pipeline.core.pose import UNSAID, MadeBy, PoseSequence
from ..pipeline.reading.joint_order import likely_layout
from .kit.clock import Moments
from .kit.json import KEYPOINTS_3D, OPENPOSE_3D, first_person, name_of, numbers, people
from .kit.names import joint_named
from .kit.people import People
from .kit.world import Maker, maker, standing_frame

name = "json3d"
gives = "poses"
reads = (
    "JSON of 3D joints: EasyMocap's keypoints3d, Azure Kinect's and ZED's bodies, in a world or a camera; folder of "
    "OpenPose's --3d --write_json"
)


def _sided(*parts: str) -> tuple[str, ...]:
    return tuple(f"{side}_{part}" for side in ("left", "right") for part in parts)


def _layout(program: str, *joints: str) -> Layout:
    return Layout(program, tuple(joint_named(joint) or joint for joint in joints))


_ARMS = _sided("clavicle", "shoulder", "elbow", "wrist", "hand", "handtip", "thumb")
_LEGS = _sided("hip", "knee", "ankle", "foot")
_FACE = ("head", "nose", "left_eye", "left_ear", "right_eye", "right_ear")
_AZURE = ("pelvis", "spine", "chest", "neck", *_ARMS, *_LEGS, *_FACE)
_PAIRS = ("eye", "ear", "clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "big_toe", "small_toe",
          "heel", "hand1", "hand2", "hand3", "hand4")  # fmt: skip
_PAIRED = (joint for part in _PAIRS for joint in _sided(part))
_LAYOUTS = {  # by the number of joints
    len(layout): (layout,)
    for layout in (
        OPENPOSE18,
        _layout("Azure Kinect", *_AZURE),
        _layout("BODY_34", *_AZURE, *_sided("heel")),  # ZED's
        _layout("BODY_38", "pelvis", "spine", "spine2", "spine3", "neck", "nose", *_PAIRED),
    )
} | {len(BODY_25): (BODY_25, BODY_25B)}


def sniff(path: Path) -> bool:
    first = first_person(path, KEYPOINTS_3D)
    try:
        points = None if first is None else _points(first[0], "")
    except InputError:
        return False
    return points is not None and len(points) in _LAYOUTS


def read(
    path: Path,
    up: str | None = None,
    unit: str | None = None,
    track: bool = False,
    made_by: Maker | None = None,
) -> tuple[PoseSequence, ...]:
    """One sequence a person, by the number that the file gives, or joined from frame to frame by nearness.

    up: "z" or "y", the axis of a world that is up, or "camera" for x right, y down, z away. unit: "m", "cm" or "mm"; of
    OpenPose's files that of the calibration. track: ignore the numbers of people. made_by: "measured" or "estimated",
    which only OpenPose's files say. InputError for other JSON, for other numbers of joints, and where neither the body
    nor an option tells the axes and the unit.
    """
    moments, sightings = Moments(str(path)), People(str(path))
    openpose = False
    for moment, person, where in people(path, "3D joints in JSON", moments):
        points = _points(person, where)
        if points is None:
            continue
        openpose = openpose or any(key in person for key in OPENPOSE_3D)
        if len(points) not in _LAYOUTS:
            raise InputError(
                "wrong-content",
                f"{where}: expected {', '.join(map(str, sorted(_LAYOUTS)))} joints, got {len(points)}.",
            )
        sightings.add(moment, points[:, :3], points[:, 3], None if track else name_of(person))
    if not len(sightings):
        raise InputError(
            "format-unknown",
            f"{path}: expected 3D joints of somebody, got none; adapter json2d reads OpenPose's 2D results.",
        )
    layout = likely_layout(sightings.points, _LAYOUTS[sightings.points.shape[1]])
    if openpose:
        up, unit = up or "camera", unit or "m"
    frame = standing_frame(sightings.points, layout, up, unit, str(path))
    made = maker(made_by, MadeBy("estimated", "OpenPose") if openpose else UNSAID)
    everybody = sightings.poses(layout, frame, moments.clock(), placed=True)
    return tuple(poses.with_(made_by=made) for poses in everybody)


def _points(person: Any, where: str) -> np.ndarray | None:
    """(J, 4) x, y, z and score, NaN where missing or not said; None for a person whom OpenPose did not reconstruct.
    InputError for anything else."""
    key = next((key for key in KEYPOINTS_3D if key in person), None) if isinstance(person, dict) else None
    if key is None:
        raise InputError(
            "wrong-content",
            f"{where}: expected a person with {' or '.join(KEYPOINTS_3D)}, got {person!r:.60}.",
        )
    if key in OPENPOSE_3D and not person[key]:
        return None
    values = numbers(person[key], where)
    if key in OPENPOSE_3D and values.ndim == 1 and not len(values) % 4:
        values = values.reshape(-1, 4)
    if values.ndim != 2 or values.shape[1] not in (3, 4):
        raise InputError(
            "wrong-content", f"{where}: expected x, y, z of each joint in {key}, got shape {values.shape}."
        )
    points = np.full((len(values), 4), np.nan)
    points[:, : values.shape[1]] = values
    points[(points[:, :3] == 0).all(axis=1) | (points[:, 3] == 0)] = np.nan
    return points if key not in OPENPOSE_3D or np.isfinite(points).any() else None
