"""2D keypoints that the demo/vis.py scripts save beside their 3D: input_2D/keypoints.npz.

MHFormer, StridedTransformer, PoseFormerV2 and MotionAGFormer write it: key `reconstruction`, (people,
frames, 17, 2) pixels in Human3.6M order, made from COCO joints; MotionAGFormer adds the score, (..., 3). There
is a row for every frame of the video, from its first. All zeros is a frame in which nobody was found.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.layouts import H36M17
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import load, peek
from .kit.people import People

name = "vis2d"
gives = "keypoints"
reads = "input_2D/keypoints.npz, or the folder it is in, of demo/vis.py (MHFormer, MotionAGFormer and kin)"

_FILE = Path("input_2D", "keypoints.npz")
_KEY = "reconstruction"
_SHAPES = (("people", "frames", len(H36M17), 2), ("people", "frames", len(H36M17), 3))


def sniff(path: Path) -> bool:
    return peek(_file(path), *_SHAPES, key=_KEY) is not None


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, "0" first, with a row for every frame; frame_index counts from 0.

    Joints at 0, 0 are missing. Confidences are the scores where the file has them, else NaN. InputError when
    the file has another form, nobody in it, or coordinates that are no pixels.
    """
    file = _file(path)
    sightings = People(str(file))
    for person, rows in enumerate(load(file, *_SHAPES, key=_KEY)):
        for frame, row in enumerate(rows):
            sightings.add(frame, row[:, :2], row[:, 2] if row.shape[1] == 3 else None, str(person))
    return sightings.keypoints(layouts=(H36M17,))


def _file(path: Path) -> Path:
    return path / _FILE if path.is_dir() else path
