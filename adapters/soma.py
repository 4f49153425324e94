"""Joints of NVIDIA's SOMA body in an .npz: `posed_joints` (frames, 77, 3) of Kimodo's format, or
(frames, 30, 3) of its first examples (formats.md section 6).

Metres in a world with gravity, y up. GEM-X saves the parameters of SOMA alone; its demo_soma_fbx.py writes a BVH of
them, which adapter bvh reads, and its motions come in Kimodo's format by whatever converts them. Eyes, jaw and head end
are joints; heels are not. Neither the frame rate nor the video frame of a row is in the file.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import Y_UP
from ..pipeline.core.layouts import SOMA30, SOMA77
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import begins, keys, load
from .kit.world import Maker, check_upright, maker

name = "soma"
gives = "poses"
reads = ".npz with posed_joints of NVIDIA's SOMA body (Kimodo's format): metres, y up"

_KEY = "posed_joints"
_LAYOUTS = {len(layout): layout for layout in (SOMA77, SOMA30)}


def sniff(path: Path) -> bool:
    shape, _ = begins(path, _KEY)
    return len(shape) == 3 and shape[1] in _LAYOUTS and shape[2] == 3


def read(path: Path, made_by: Maker | None = None) -> tuple[PoseSequence]:
    """The one person of the file: SOMA77 or SOMA30 in the Y-up world, metres.

    made_by: "measured" or "estimated", which the file does not say. InputError when the file has no such array, and
    when the person does not stand along y.
    """
    if not keys(path):
        raise InputError(
            "wrong-content", f"{path}: expected an .npz with the array {_KEY}, got an array without a name."
        )
    joints = load(path, *(("frames", count, 3) for count in _LAYOUTS), key=_KEY)
    poses = PoseSequence(
        joints=joints,
        layout=_LAYOUTS[joints.shape[1]],
        frame=Y_UP,
        frames_known=False,
        made_by=maker(made_by),
    )
    check_upright(poses, str(path), "turn the file's axes first")
    return (poses,)
