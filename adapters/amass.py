"""Joints of a body model in an .npz beside AMASS's own arrays: `joints` (T, J, 3) and a frame rate (formats.md
section 7).

Metres and z up, as AMASS has it. J is 22 and more in SMPL's order, 17 (H36M17), or named by an array `joint_names`.
AMASS's own files hold the model's parameters: joints come out of them only with the body model, whose licence is its
owner's, so they are recognised and refused. Which video frame a row is cannot be known.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.messages import how_many
from ..pipeline.core.pose import UNSAID, MadeBy, PoseSequence
from ..pipeline.files.arrays import arrays_in, keys, load, load_all
from ..pipeline.files.markers import Markers, Up
from ..pipeline.files.skeletons import SMPL
from .kit.world import Maker, maker, people_of

name = "amass"
gives = "poses"
reads = ".npz of AMASS with joints beside the parameters: metres, z up, SMPL's order or named"
marks = ("joints", "mocap_framerate", "poses", "trans", "betas")

_MOCAP_RATES = ("mocap_framerate", "mocap_frame_rate")
_RATES = (*_MOCAP_RATES, "fps")
_PARAMETERS = {"poses", "trans", "betas"}


def sniff(path: Path) -> bool:
    held = arrays_in(path)
    return held >= _PARAMETERS or ("joints" in held and bool(held & set(_RATES)) and "clip_start" not in held)


def read(
    path: Path, unit: str = "m", up: Up | None = None, made_by: Maker | None = None
) -> tuple[PoseSequence, ...]:
    """The one person of the file in its world, with time stamps from its rate.

    unit: "m", "mm", "cm" or "inch". up: "y" or "z", the axis that is up; without it the person has to stand along z.
    made_by: "measured" or "estimated"; without it files with AMASS's own parameters and a frame rate of "mocap" are
    motion capture, and of others it is not known. InputError for parameters without joints, for joints without names in
    use, and for a file without a rate.
    """
    held = keys(path)
    if "joints" not in held and _PARAMETERS & set(held):
        raise InputError(
            "wrong-content",
            f"{path}: expected an array 'joints', got parameters of a body model alone (AMASS); run the body model and "
            "save its joints with a frame rate.",
        )
    joints = load(path, ("frames", "joints", 3), key="joints")
    rate = next((float(load(path, (), (1,), key=key).squeeze()) for key in _RATES if key in held), 0.0)
    if not 0 < rate < 10_000:
        raise InputError(
            "needs-rate", f"{path}: expected a frame rate in {', '.join(_RATES)}, got {rate or 'none'}."
        )
    rows = np.arange(len(joints))
    names = _names(path, held, joints.shape[1])
    found = Markers(names, joints.astype(np.float64), rows / rate, unit, "z", rows)
    # By AMASS's own words; who saves an estimator's joints in its form has no rate of motion capture.
    captured = set(held) >= _PARAMETERS and bool(set(held) & set(_MOCAP_RATES))
    says = MadeBy("measured", "motion capture (AMASS)") if captured else UNSAID
    return people_of(found, str(path), None, up, maker(made_by, says))


def _names(path: Path, held: tuple[str, ...], count: int) -> list[str]:
    if "joint_names" in held:
        names = [str(name) for name in load_all(path, "joint_names")["joint_names"].ravel()]
    elif count == len(H36M17):
        names = list(H36M17.joints)
    else:
        names = [*SMPL[:count], *(f"more{i}" for i in range(count - len(SMPL)))]
    if len(names) != count:
        raise InputError(
            "wrong-content",
            f"{path}: expected a name for each of {how_many(count, 'joint')}, got {len(names)}.",
        )
    return names
