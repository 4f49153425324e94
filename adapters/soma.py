"""Joints of NVIDIA's SOMA body in an .npz: `posed_joints` (frames, 77, 3) of Kimodo's format (formats.md section 15).

Metres in a world with gravity, y up. GEM-X saves the parameters of SOMA alone; its demo_soma_fbx.py writes a BVH of
them, which adapter bvh reads, and its motions come in Kimodo's format by whatever converts them. Eyes, jaw and head end
are joints; heels are not. Neither the frame rate nor the video frame of a row is in the file.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.errors import InputError
from ..pipeline.frames import Y_UP
from ..pipeline.layouts import SOMA77
from ..pipeline.pose import PoseSequence
from .kit.numpy import keys, load, shape_in
from .kit.world import check_upright

name = "soma"
gives = "poses"
reads = ".npz with posed_joints of NVIDIA's SOMA body (Kimodo's format): metres, y up"

_KEY = "posed_joints"
_SHAPE = (len(SOMA77), 3)


def sniff(path: Path) -> bool:
    shape = shape_in(path, _KEY)
    return len(shape) == 3 and shape[1:] == _SHAPE


def read(path: Path) -> tuple[PoseSequence]:
    """The one person of the file: SOMA77 in the Y-up world, metres.

    InputError when the file has no such array, and when the person does not stand along y.
    """
    if not keys(path):
        raise InputError(f"{path}: expected an .npz with the array {_KEY}, got an array without a name.")
    joints = load(path, ("frames", *_SHAPE), key=_KEY)
    poses = PoseSequence(joints=joints, layout=SOMA77, frame=Y_UP, frames_known=False)
    check_upright(poses, str(path))
    return (poses,)
