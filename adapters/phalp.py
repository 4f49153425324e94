"""4D-Humans' and PHALP's tracks, `outputs/results/<video>.pkl`.

A dict of frames, each of lists with an entry a person: `tid`, `3d_joints` (45, 3), `tracked_time`. The first 25 joints
are OpenPose's BODY_25 taken from SMPL's mesh, then come 19 of another regressor and a zero (PHALP
phalp/models/hmar/hmar.py, get_3d_parameters; phalp/utils/smpl_utils.py). Metres in camera axes about the body model's
origin; the camera's distance is made of an assumed focal length and is not used. A person whose `tracked_time` is not
0 was not seen in that frame but remembered, and is left out. `time` is the video frame, from 0; the rate is not in
the file.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import BODY_25
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import shaped
from .kit.people import People
from .kit.pickles import beginning, load

name = "phalp"
gives = "poses"
made_by = MadeBy("estimated", "PHALP")
reads = "4D-Humans and PHALP tracks (.pkl): camera axes, metres"

_JOINTS = "3d_joints"
_COUNT = 45


def sniff(path: Path) -> bool:
    start = beginning(path)
    return _JOINTS.encode() in start and b"tid" in start


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a track: BODY_25 in CAMERA axes, metres, in the frames in which the person was seen.

    InputError when the file holds anything but arrays and plain containers, is not of this form, or has no joints.
    """
    frames = load(path)
    if not isinstance(frames, dict) or not all(isinstance(frame, dict) for frame in frames.values()):
        raise InputError(
            "format-unknown", f"{path}: expected a dict of frames, as PHALP writes it, got another pickle."
        )
    tracks = People(str(path))
    numbered = all("time" in frame for frame in frames.values())
    for row, (image, frame) in enumerate(frames.items()):
        where, ids, bodies = f"{path}, frame {image}", frame.get("tid"), frame.get(_JOINTS)
        ages = frame.get("tracked_time", [0] * len(ids) if isinstance(ids, list) else None)
        if not all(isinstance(held, list) and len(held) == len(ids) for held in (ids, bodies, ages)):
            raise InputError(
                "wrong-content",
                f"{where}: expected lists 'tid', '{_JOINTS}' and maybe 'tracked_time' with an entry per person.",
            )
        for person, joints, age in zip(ids, bodies, ages, strict=True):
            joints = shaped(joints, f"{where}, '{_JOINTS}'", (_COUNT, 3))
            if age == 0:
                tracks.add(
                    int(frame["time"]) if numbered else row, joints[: len(BODY_25)], person=str(person)
                )
    people = tracks.poses(BODY_25, CAMERA.with_(origin="body model"))
    return tuple(poses.with_(frames_known=numbered) for poses in people)
