"""What DDHPose's and D3DP's `main_3dhp.py` save of MPI-INF-3DHP: inference_data_<aggregation>.mat (formats.md 2.3).

An array (3, 17, frames, steps) for each of the test sequences TS1 to TS6: x, y, z in camera axes, millimetres, the 17
joints of MPI-INF-3DHP with the pelvis at the origin. The last sampling step is taken; the proposals are aggregated
already. Clips are of 243 frames, and the last one, of the sequence's LAST 243 frames, is written over the one before
it. Frame rate and video frames are not in the file. There is no nose: the middle of the head stands in.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.layouts import MPI3DHP17
from ..pipeline.core.pose import MadeBy, PoseSequence
from .kit.matlab import keys, load
from .kit.numpy import shaped

name = "ddhpose_3dhp"
gives = "poses"
made_by = MadeBy("estimated", "DDHPose")
reads = "DDHPose's and D3DP's inference_data_*.mat of MPI-INF-3DHP, with option sequence: camera axes, millimetres"

_SEQUENCES = tuple(f"TS{number}" for number in range(1, 7))
_CLIP = 243


def sniff(path: Path) -> bool:
    return bool(keys(path) & set(_SEQUENCES))


def read(path: Path, sequence: str | None = None) -> tuple[PoseSequence]:
    """The one person of a sequence: MPI3DHP17 in CAMERA, millimetres.

    sequence: "TS1" to "TS6"; may be left out where the file has only one. InputError when the file is damaged, of
    MATLAB 7.3, or has no such sequence.
    """
    held = load(path, *_SEQUENCES, what="DDHPose's or D3DP's results on MPI-INF-3DHP")
    if sequence is None and len(held) == 1:
        sequence = next(iter(held))
    if sequence not in held:
        raise InputError(
            "choose-entry",
            f"{path} holds the sequences {', '.join(sorted(held)) or 'of no test video'}; "
            f"name one with sequence=TS1 (--option sequence=TS1), got {sequence or 'none'}.",
        )
    shape = (3, len(MPI3DHP17), "frames")
    stored = shaped(held[sequence], f"{path}, array '{sequence}'", (*shape, "steps"), shape)
    joints = np.transpose(stored[..., -1] if stored.ndim > len(shape) else stored, (2, 1, 0))
    frames = len(joints)
    starts = {*range(_CLIP, frames - _CLIP, _CLIP), frames - _CLIP} if frames > _CLIP else ()
    frame = CAMERA.with_(origin="camera", unit="mm")
    return (PoseSequence(joints, MPI3DHP17, frame, seams=tuple(sorted(starts))),)
