"""3D reconstruction of OpenPose (--3d --write_json): a folder of `*_keypoints.json` with `pose_keypoints_3d`.

One file a frame, as in 2D (formats.md 6), where each of BODY_25's or COCO-18's joints is x, y, z and 1, or 0 for one
that was not found, all four of them; older documents call the field `body_keypoints_3d`. Axes are those of the camera
that the calibration took for the origin, x right, y down, z where it looks, in metres (OpenPose's
doc/advanced/calibration_module.md). Whoever calibrated with other tools names the unit with option unit.
Files of 2D runs hold the field too, empty.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import BODY_25, BODY_25B, OPENPOSE18
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.reading.joint_order import likely_layout
from .kit.clock import Moments
from .kit.frames import frame_files, people, people_of
from .kit.json import beginning, numbers
from .kit.people import People

name = "openpose3d"
gives = "poses"
made_by = MadeBy("estimated", "OpenPose")
reads = "folder of *_keypoints.json from OpenPose's --3d --write_json, metres (option unit)"
marks = ("people", "pose_keypoints_3d")

_FIELDS = ("pose_keypoints_3d", "body_keypoints_3d")
_LAYOUTS = {25: (BODY_25, BODY_25B), 18: (OPENPOSE18,)}  # by the number of joints
_PEEKED = 100  # files; nobody may be there in the first ones


def sniff(path: Path) -> bool:
    for file in frame_files(path)[:_PEEKED] if path.is_dir() else ():
        listed = people_of(beginning(file))
        if listed is None:
            return False
        if any(isinstance(person, dict) and _flat(person) for person in listed):
            return True
    return False


def read(path: Path, unit: str = "m") -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by nearness: axes of the camera at the origin.

    unit: that of the calibration: "m", "mm", "cm", "inch" or "arbitrary".
    BODY_25 and BODY_25B are told apart by the bones of all bodies. The score 1 of every joint that was found says no
    more than that, so confidences are unknown.
    frame_index = number in the file's name; a frame without a person has no row; a joint that was not found is NaN.
    Raises InputError when the folder holds no such files, those of several videos, or 2D results only.
    """
    moments, found = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "OpenPose's people of one frame", moments):
        points = _points(person, where)
        if points is None:
            continue
        joints = np.where(points[:, 3:] > 0, points[:, :3], np.nan)
        if len(points) not in _LAYOUTS:
            raise InputError("wrong-content", f"{where}: expected 25 or 18 joints, got {len(points)}.")
        if np.isfinite(joints).any():
            found.add(moment, joints, np.where(points[:, 3] > 0, points[:, 3], np.nan))
    if not len(found):
        raise InputError(
            "format-unknown",
            f"{path}: expected OpenPose's 3D results ({_FIELDS[0]}), found none; adapter json2d "
            f"reads its 2D results.",
        )
    layout = likely_layout(found.points, _LAYOUTS[found.points.shape[1]])
    return found.poses(layout, CAMERA.with_(origin="camera", unit=unit), moments.clock(), placed=True)


def _flat(person: dict[str, Any]) -> Any:
    return next((person[name] for name in _FIELDS if person.get(name)), None)


def _points(person: Any, where: str) -> np.ndarray | None:
    """(J, 4) x, y, z and whether found; None for a person who was not reconstructed."""
    flat = _flat(person) if isinstance(person, dict) else None
    if flat is None:
        return None
    values = numbers(flat, where)
    if values.ndim != 1 or len(values) % 4:
        raise InputError(
            "wrong-content",
            f"{where}: expected x, y, z and score of each joint in one list, got shape {values.shape}.",
        )
    return values.reshape(-1, 4)
