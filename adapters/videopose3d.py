"""VideoPose3D and the lifters that save what it saves: metres in camera axes, relative to the pelvis; a bare .npy, or
`reconstruction` in an .npz (formats.md 2).

An .npy whose pelvis is exactly 0 in every frame could as well be MotionBERT's with `rootrel`, or DDHPose's: such a file
fits all three and has to be named.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import keys, peek, plain_array
from .kit.lifters import FRAMES, check_metric, fits, in_camera, looks_metric

name = "videopose3d"
gives = "poses"
made_by = MadeBy("estimated", "a lifter of VideoPose3D's format (such as MHFormer)")
reads = "VideoPose3D, MixSTE, video-to-pose3D (.npy), MHFormer, StridedTransformer (.npz or the vis.py folder), metres"


_KEY = "reconstruction"
_IN_FOLDER = Path("output_3D", "output_keypoints_3d.npz")


def sniff(path: Path) -> bool:
    file = _file(path)
    joints = peek(file, FRAMES, key=_KEY)
    return name in fits(file) if joints is None else looks_metric(joints)


def read(path: Path, clip: int | None = None) -> tuple[PoseSequence]:
    """The one person of the file: H36M17 in camera axes, metres, the pelvis where the file has it.

    path: the file, or the output folder of a vis.py, which holds output_3D/output_keypoints_3d.npz.
    clip: frames per clip of a lifter that works clip by clip (MixSTE: 243), for the seams between clips;
        the others look at a window around every frame and have none.
    A vis.py writes one row for every frame of the video, so its rows' video frames are known; those of an
    .npy are not. Raises InputError when the file is no such array, not in metres, or made for display.
    """
    file = _file(path)
    key = _KEY if keys(file) else None
    joints = plain_array(file, FRAMES, key=key)
    numbered: dict[str, Any] = {"frame_index": np.arange(len(joints))} if key else {}
    poses = in_camera(joints, clip, **numbered)
    check_metric(file, poses.joints, trajectory=True)
    return (poses,)


def _file(path: Path) -> Path:
    return path / _IN_FOLDER if path.is_dir() else path
