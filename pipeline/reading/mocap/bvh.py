"""Motion capture in BVH files (pipeline/files/bvh.py): +Y up, in the unit that fits the legs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...files.bvh import read_motion
from .clip import Clip
from .common import Found, How, label, read_text, require_plausible, z_up

PATTERN = "**/*.[bB][vV][hH]"


def read(path: Path, folder: Path, how: How) -> Found:
    """One clip; +Y is up unless `how` says otherwise, and the unit the one that fits the legs. InputError otherwise."""
    found = read_motion(read_text(path), how.unit)
    notes = []
    if found.first:
        notes.append(f"the T-pose and the {found.first - 1} frames after it are left out")
    if how.unit is None:
        notes.append(f"unit {found.unit}, by the length of the legs")
    joints = z_up(found.joints, how.up or "y").astype(np.float32)
    require_plausible(joints)
    subject, name = label(path, folder, how.subject)
    return Found(Clip(name, subject, "bvh", how.fps or found.fps, joints), tuple(notes))
