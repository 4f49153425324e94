"""Joints of a body model in an .npz beside AMASS's own arrays: `joints` (T, J, 3) and a frame rate (formats.md
section 6).

Metres and z up, as AMASS has it. J is 22 and more in SMPL's order, 17 (H36M17), or named by an array `joint_names`.
AMASS's own files hold the model's parameters: joints come out of them only with the body model, whose licence is its
owner's, so they are recognised and refused. Files with these parameters and a frame rate of "mocap" are motion
capture; of others nobody knows. Which video frame a row is cannot be known.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.files.arrays import arrays_in
from ..pipeline.files.markers import PARAMETERS, RATES, read_joints
from .kit.world import reader_of

name = "amass"
gives = "poses"
reads = ".npz of AMASS with joints beside the parameters: metres, z up, SMPL's order or named"


def sniff(path: Path) -> bool:
    held = arrays_in(path)
    return held >= PARAMETERS or ("joints" in held and bool(held & {*RATES}) and "clip_start" not in held)


read = reader_of(read_joints)
