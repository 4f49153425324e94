"""TotalCapture's motion capture, `gt_skel_gbl_pos.txt`: 21 joints in inches, Vicon world, y up (formats.md 8.2).

First line: the joints' names, separated by tabs; each later line: as many cells of "x y z". The rate is the data set's
60 a second. Which video frame a row is cannot be known: readers disagree whether the streams begin or end together.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Y_UP
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.beginning import first_bytes
from .kit.tables import filled_lines

name = "totalcapture"
gives = "poses"
made_by = MadeBy("measured", "TotalCapture's Vicon cameras")
reads = "TotalCapture's gt_skel_gbl_pos.txt: motion capture, inches, y up"

_RATE_HZ = 60.0
# Where each joint of the 17 is, as the mean of theirs. There is no nose: the point between neck and head stands in.
_JOINTS: dict[str, tuple[str, ...]] = {
    "pelvis": ("Hips",), "spine": ("Spine1",), "thorax": ("Neck",), "nose": ("Neck", "Head"), "head": ("Head",),
    **{
        f"{side[0].lower()}_{ours}": (f"{side}{theirs}",)
        for side in ("Right", "Left")
        for ours, theirs in (
            ("hip", "UpLeg"), ("knee", "Leg"), ("ankle", "Foot"),
            ("shoulder", "Arm"), ("elbow", "ForeArm"), ("wrist", "Hand"),
        )
    },
}  # fmt: skip


def sniff(path: Path) -> bool:
    """Whether the first line has the names of the joints that are needed."""
    line = first_bytes(path, 4096).partition(b"\n")[0]
    return _needed() <= set(line.decode(errors="ignore").split())


def read(path: Path, rate_hz: float = _RATE_HZ) -> tuple[PoseSequence]:
    """The one person of the file: H36M17 in the Y-up world with the pelvis where it was, inches, 60 frames a second.

    Raises InputError when the file is not what it should be.
    """
    lines = filled_lines(path, "TotalCapture's joint positions")
    names = lines[0].split()
    missing = sorted(_needed() - set(names))
    if missing:
        raise InputError(
            "wrong-content",
            f"Expected TotalCapture's joint names in the first line of {path}; it lacks {', '.join(missing)}.",
        )
    try:
        values = np.array([line.split() for line in lines[1:]], dtype=np.float64)
        joints = values.reshape(-1, len(names), 3)
    except ValueError:
        raise InputError(
            "file-damaged",
            f"Expected {3 * len(names)} numbers in each later line of {path}; it was cut short or is damaged, "
            "copy it again.",
        ) from None
    chosen = [[names.index(their) for their in theirs] for theirs in (_JOINTS[j] for j in H36M17.joints)]
    poses = PoseSequence(
        joints=np.stack([joints[:, columns].mean(axis=1) for columns in chosen], axis=1),
        layout=H36M17,
        frame=Y_UP.with_(unit="inch"),
        time_s=np.arange(len(joints)) / rate_hz,
    )
    return (poses.deriving("totalcapture", {"nose": "mean(Neck, Head)"}),)


def _needed() -> set[str]:
    return {their for theirs in _JOINTS.values() for their in theirs}
