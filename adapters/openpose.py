"""A folder of OpenPose's --write_json: one `<video>_<number>_keypoints.json` a frame (formats.md 6).

Each file holds {version, people: [{pose_keypoints_2d: x, y, score of every joint, ...}]}, of BODY_25, BODY_25B or the
18 joints of the COCO model; the first two have as many joints and are told apart by the lengths of the bones. OpenPose
1.0 calls the field pose_keypoints. Pose2Sim and Sports2D write such folders of 17, 26 and 133 joints.
Frames count from 0; a frame without people has a file with an empty list. OpenPose writes 0, 0, 0 for a joint that it
did not find, and does not follow people: they are joined frame by frame. Scores are in [0, 1] (doc/02_output.md of
OpenPose).
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.frames import frame_files, keypoints_of, people
from .kit.json import beginning
from .kit.people import People

name = "openpose"
gives = "keypoints"
reads = "folder of OpenPose's --write_json, Pose2Sim's or Sports2D's: one numbered file a frame, of 17 to 133 joints"
marks = ("people", "pose_keypoints_2d")


def sniff(path: Path) -> bool:
    first = next(iter(frame_files(path)), None) if path.is_dir() else None
    content = beginning(first) if first else None
    return isinstance(content, dict) and isinstance(content.get("people"), list)


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by nearness; frame_index = number in the file's name.

    A frame without a person has no row. Raises InputError when the folder holds no such files or those of
    several videos, and when a file is not OpenPose's.
    """
    if not path.is_dir():
        raise InputError(
            "format-unknown", f"Expected a folder of OpenPose's files, one a frame, at {path}, got a file."
        )
    moments, found = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "OpenPose's people of one frame", moments):
        found.add(moment, *keypoints_of(person, where))
    return found.keypoints(moments.clock())
