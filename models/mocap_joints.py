"""NumPy files that already hold joints: `joints` (T, J, 3) and a frame rate.

J is 17 (H36M17) or 22 and more in SMPL's order, or named by an array `joint_names`. Files of body-model parameters, as
AMASS gives them, are refused: joints come out of them only with the body model, whose licence is its owner's.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from ..pipeline.errors import InputError
from ..pipeline.layouts import H36M17
from ..pipeline.rotations import unit
from .mocap import Clip
from .mocap_file import UNITS, Found, How, label, require_plausible, z_up
from .mocap_skeleton import h36m17, match

PATTERN = "**/*.[nN][pP][zZ]"
_RATES = ("fps", "mocap_framerate", "mocap_frame_rate")
# The body of SMPL; SMPL-H and SMPL-X go on with hands and face (formats.md section 7).
_SMPL = (
    "pelvis", "l_hip", "r_hip", "spine1", "l_knee", "r_knee", "spine2", "l_ankle", "r_ankle", "spine3", "l_toes",
    "r_toes", "neck", "l_collar", "r_collar", "head", "l_shoulder", "r_shoulder", "l_elbow", "r_elbow", "l_wrist",
    "r_wrist",
)  # fmt: skip
_SPINE = ("spine", "spine1", "spine2", "spine3")


def read(path: Path, folder: Path, how: How) -> Found:
    """One clip; metres and +Z up, as AMASS has it, unless `how` says otherwise. InputError for anything else."""
    try:
        with np.load(path, allow_pickle=False) as file:
            if "joints" not in file.files:
                model = {"poses", "betas"} & set(file.files)
                raise InputError(
                    "it holds body-model parameters (AMASS), not joints; run the body model and save its joints."
                    if model
                    else f"expected an array `joints`, got {', '.join(file.files) or 'none'}."
                )
            joints = file["joints"].astype(np.float64)
            names = [str(name) for name in file["joint_names"]] if "joint_names" in file.files else None
            rates = [float(file[name]) for name in _RATES if name in file.files]
    except (OSError, zipfile.BadZipFile, ValueError, EOFError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"expected a .npz file of plain arrays: {error}.") from None
    fps = how.fps or next(iter(rates), None)
    if not fps or fps <= 0:
        raise InputError(f"expected the frame rate in {', '.join(_RATES)}; say it with --fps.")
    joints = h36m17_named(joints, names) * UNITS[how.unit or "m"]
    joints = z_up(joints, how.up or "z").astype(np.float32)
    require_plausible(joints)
    subject, name = label(path, folder, how.subject)
    return Found(Clip(name, subject, "joints", fps, joints))


def h36m17_named(joints: np.ndarray, names: list[str] | None) -> np.ndarray:
    """(T, 17, 3) from joints (T, J, 3) by their names, or by their order without names (17, or SMPL's 22 and more).

    InputError when a joint has no known name.
    """
    if joints.ndim != 3 or joints.shape[-1] != 3 or (names is not None and len(names) != joints.shape[1]):
        raise InputError(f"expected joints (T, J, 3), a name for each, got {joints.shape}.")
    if names is None:
        if joints.shape[1] == len(H36M17):
            return joints
        if joints.shape[1] < len(_SMPL):
            raise InputError(
                f"expected 17 joints (H36M17) or SMPL's 22 and more, got {joints.shape[1]}; add an array joint_names."
            )
        names = [*_SMPL, *(f"more{i}" for i in range(joints.shape[1] - len(_SMPL)))]
    if set(H36M17.joints) <= set(names):
        return joints[:, [names.index(joint) for joint in H36M17.joints]]
    points = {joint: joints[:, i] for joint, i in match(names).items()}
    # Nothing says where the head looks: straight ahead, along the neck and across the shoulders.
    up = unit(points["head"] - points["neck"])
    forward = unit(np.cross(points["l_shoulder"] - points["r_shoulder"], up))
    spine = [names.index(name) for name in _SPINE if name in names]
    return h36m17(points, joints[:, spine], forward, up)
