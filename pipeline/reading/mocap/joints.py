"""NumPy files that already hold joints: `joints` (T, J, 3) and a frame rate.

J is 17 (H36M17) or 22 and more in SMPL's order, or named by an array `joint_names`. Files of body-model parameters, as
AMASS gives them, are refused: joints come out of them only with the body model, whose licence is its owner's.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...files.arrays import keys, load, load_all
from ...files.skeletons import UNITS, h36m17_named, h36m17_of_limbs
from .clip import Clip
from .common import Found, How, label, require_a_person, require_plausible, z_up

PATTERN = "**/*.[nN][pP][zZ]"
_RATES = ("fps", "mocap_framerate", "mocap_frame_rate")


def read(path: Path, folder: Path, how: How, parts: bool = False) -> Found:
    """One clip; metres and +Z up, as AMASS has it, unless `how` says otherwise. parts: whether limbs alone will do, the
    rest being NaN. InputError for anything else."""
    held = keys(path)
    if "joints" not in held:
        raise InputError(
            "wrong-content",
            "it holds body-model parameters (AMASS), not joints; run the body model and save its joints."
            if {"poses", "betas"} & set(held)
            else f"expected an array `joints`, got {', '.join(held) or 'none'}.",
        )
    joints = load(path, ("frames", "joints", 3), key="joints").astype(np.float64)
    names = None
    if "joint_names" in held:
        names = [str(name) for name in load_all(path, "joint_names")["joint_names"].ravel()]
    rates = [float(load(path, (), (1,), key=name).squeeze()) for name in _RATES if name in held]
    fps = how.fps or next(iter(rates), None)
    if not fps or fps <= 0:
        raise InputError("needs-rate", f"expected the frame rate in {', '.join(_RATES)}; give it with --fps.")
    joints *= UNITS[how.unit or "m"]
    try:
        whole, require = h36m17_named(joints, names), require_plausible
    except InputError:
        if not parts or names is None or len(names) != joints.shape[1]:
            raise
        whole, require = h36m17_of_limbs(joints, names), require_a_person
    joints = z_up(whole, how.up or "z").astype(np.float32)
    require(joints)
    subject, name = label(path, folder, how.subject)
    return Found(Clip(name, subject, "joints", fps, joints))
