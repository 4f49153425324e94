"""BVH: an animated skeleton with names, as motion capture programs export it (formats.md section 6).

Y up unless the option `up` says z. The unit is not in the file: it is the one in which the legs are an adult's, and
metres of a child in our own files. Where they are no joints, nose and top of the head are points of the head's own
axes; pipeline/files/skeletons.py says how the 17 joints are made. A first frame in which nothing is turned is an added
T-pose: it and the nine frames smoothed into it are left out. Which video frame a row is cannot be known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError, naming, readable
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.markers import Up
from ..pipeline.files.opened import first_bytes
from ..pipeline.files.skeletons import UNITS
from .kit.world import Maker, check_upright, maker, world

name = "bvh"
gives = "poses"
reads = "BVH of motion capture programs: skeletons under names in use, y up"

_BEGINS = b"HIERARCHY"


def sniff(path: Path) -> bool:
    return first_bytes(path, 256).removeprefix(b"\xef\xbb\xbf").lstrip().startswith(_BEGINS)


def read(
    path: Path, unit: str | None = None, up: Up | None = None, made_by: Maker | None = None
) -> tuple[PoseSequence]:
    """The one person of the file: H36M17, metres, in its world, with time stamps from its frame time.

    unit: "m", "cm", "mm", "inch" or "asf" (0.0254 / 0.45 m, CMU's), where the legs do not tell. up: "y" or "z", the
    axis that is up; without it the person has to stand along y. made_by: "measured" or "estimated", which the file does
    not say. InputError when the file is damaged or its joints have names that are not in use.
    """
    if unit is not None and unit not in UNITS:
        raise InputError("bad-value", f"Expected a unit of {', '.join(UNITS)}; got '{unit}'.")
    from ..pipeline.files.bvh import read_motion

    with readable(path, "a BVH file"):
        text = path.read_text(encoding="utf-8", errors="replace")
    with naming(path):
        motion = read_motion(text, unit)
    poses = PoseSequence(
        joints=motion.joints,
        layout=H36M17,
        frame=world(up or "y", "m"),
        time_s=(motion.first + np.arange(len(motion.joints))) / motion.fps,
        made_by=maker(made_by),
    )
    if up is None:
        check_upright(poses, str(path))
    return (poses.deriving("bvh", motion.derived, unit=motion.unit, frames_left_out=motion.first),)
