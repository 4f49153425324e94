"""Joints of a body model in an .npz beside AMASS's own arrays: `joints` (T, J, 3) and a frame rate (formats.md
section 6).

Metres and z up, as AMASS has it. J is 22 and more in SMPL's order, 17 (H36M17), or named by an array `joint_names`.
AMASS's own files hold the model's parameters: joints come out of them only with the body model, whose licence is its
owner's, so they are recognised and refused. Which video frame a row is cannot be known.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import arrays_in
from ..pipeline.files.markers import PARAMETERS, RATES, Up, read_joints
from .kit.world import Maker, maker, people_of

name = "amass"
gives = "poses"
reads = ".npz of AMASS with joints beside the parameters: metres, z up, SMPL's order or named"


def sniff(path: Path) -> bool:
    held = arrays_in(path)
    return held >= PARAMETERS or ("joints" in held and bool(held & {*RATES}) and "clip_start" not in held)


def read(
    path: Path, unit: str = "m", up: Up | None = None, made_by: Maker | None = None
) -> tuple[PoseSequence, ...]:
    """The one person of the file in its world, with time stamps from its rate.

    unit: "m", "mm", "cm" or "inch". up: "y" or "z", the axis that is up; without it the person has to stand along z.
    made_by: "measured" or "estimated"; without it files with AMASS's own parameters and a frame rate of "mocap" are
    motion capture, and of others it is not known. InputError for parameters without joints, for joints without names in
    use, and for a file without a rate.
    """
    markers = read_joints(path)
    return people_of(markers, str(path), unit, up, maker(made_by, markers.made_by))
