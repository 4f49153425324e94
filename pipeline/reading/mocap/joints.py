"""NumPy files that already hold joints (pipeline/files/markers.py), as clips."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...files.markers import read_joints
from ...files.skeletons import UNITS, h36m17_named, h36m17_of_limbs
from .clip import Clip
from .common import Found, How, label, require_a_person, require_plausible, z_up

PATTERN = "**/*.[nN][pP][zZ]"


def read(path: Path, folder: Path, how: How, parts: bool = False) -> Found:
    """One clip; metres and +Z up, as AMASS has it, unless `how` says otherwise. parts: whether limbs alone will do, the
    rest being NaN. InputError for anything else."""
    held = read_joints(path, how.fps)
    joints = held.points * UNITS[how.unit or "m"]
    try:
        whole, require = h36m17_named(joints, held.names), require_plausible
    except InputError:
        if not parts:
            raise
        whole, require = h36m17_of_limbs(joints, held.names), require_a_person
    joints = z_up(whole, how.up or held.up).astype(np.float32)
    require(joints)
    subject, name = label(path, folder, how.subject)
    fps = 1 / float(held.time_s[1]) if len(joints) > 1 else 1.0  # one frame has no rate
    return Found(Clip(name, subject, "joints", fps, joints))
