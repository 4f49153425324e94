"""MotionBERT's X3D.npy, as `infer_wild.py` writes it (formats.md 2).

(T, 17, 3) in camera axes. Two things set it apart from other arrays of that shape, both from the script:
without `rootrel` (its default configuration) the pelvis moves and its depth is exactly 0 in a clip's first
frame; with `rootrel` the pelvis is exactly 0 throughout. A root of exact zeros is also what DDHPose and VideoPose3D
save, whose metres cannot be told from MotionBERT's units by size: such a file fits three adapters and has to be named.
A row is a detection of AlphaPose's list: without `--focus` those of several people follow each other as if of one.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import CAMERA
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.files.arrays import plain_array
from .kit.lifters import CLIP, FRAMES, fits, in_camera, in_pixels

name = "motionbert"
gives = "poses"
made_by = MadeBy("estimated", "MotionBERT")
reads = (
    "X3D.npy of MotionBERT's infer_wild.py, Human3.6M order, no known scale (with option pixel: from --pixel)"
)


def sniff(path: Path) -> bool:
    return name in fits(path)


def read(path: Path, pixel: bool = False, clip: int = CLIP) -> tuple[PoseSequence]:
    """The one person of the file: H36M17 in camera axes, "arbitrary" unit, the pelvis where the file has it.

    pixel: the file comes from `infer_wild.py --pixel`: x, y in pixels of the image, z in the same scale.
        A pixel is no length, so the unit is "arbitrary" here too.
    clip: frames that the network saw at once (`--clip_len`); clips do not overlap, so a clip boundary lies between.
    Which video frames the rows belong to is unknown: frames without a detection are missing from the file.
    Raises InputError when the file is no such array or its values contradict `pixel`.
    """
    joints = plain_array(path, FRAMES)
    if in_pixels(joints) != pixel:
        forms = ("normalised coordinates of about -1 to 1", "values far beyond 2")
        raise InputError(
            "wrong-axes",
            f"{path}: expected MotionBERT's {forms[pixel]}, got {forms[not pixel]}; pass pixel=true (--option "
            "pixel=true) for files of infer_wild.py --pixel alone, and read millimetres with --adapter arrays -O "
            "layout=H36M17 -O frame=CAMERA -O unit=mm.",
        )
    frame = CAMERA.with_(origin="image corner" if pixel else "crop centre", unit="arbitrary")
    return (in_camera(joints, clip, frame=frame),)
