"""MM-Fi (Yang et al. 2023): E0x/Sxx/Axx/ground_truth.npy, 40 people, 27 actions, 10 frames a second, one camera.

Joints are mapped by index, order A of formats.md; the names that are printed for this data set elsewhere are mirrored
(formats.md section 7.1). A clip has the paper's axes, x away from the sensor, y left, z up, as the sensor stands: how
it was mounted is not published, so +Z is up but for the sensor's own tilt.

The protocols are those of the data set's toolbox: github.com/ybhbingo/MMFi_dataset @ 269f648, mmfi_lib/mmfi.py
(decode_config) and config.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA, PC_CAMERA, Z_UP
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate
from ....pipeline.files.arrays import load
from ....pipeline.files.skeletons import leg_length, upright_share
from ....pipeline.running.progress import each
from ....pipeline.signals.checks import chirality
from .clips import Clip

PATTERN = "E[0-9][0-9]/S[0-9][0-9]/A[0-9][0-9]/ground_truth.npy"
FPS = 10.0
SUBJECTS = tuple(f"S{i:02d}" for i in range(1, 41))
# Who is tested, of all 40, in all actions: across subjects every fifth, across environments those recorded in E04.
PROTOCOLS = {"S2": set(SUBJECTS[4::5]), "S3": set(SUBJECTS[30:])}

_LEG_M = (0.5, 1.15)
_PC_FROM_CAMERA = PC_CAMERA.basis @ CAMERA.basis.T


def read_tree(tree: Path) -> list[Clip]:
    """The recordings of a tree, named by subject and action ("S05_A13"). InputError where there is none, for a file
    that is no such recording, and of recordings that contradict what is assumed of their joints."""
    files = sorted({*tree.glob(PATTERN), *tree.glob(f"*/{PATTERN}")})
    if not files:
        raise InputError("nothing-usable", f"Expected recordings as {PATTERN} in {tree}, found none.")
    clips = [_read(path) for path in each(files, "files", len(files))]
    check(clips)
    return clips


def _read(path: Path) -> Clip:
    """One recording, in metres."""
    _, subject, action = path.parts[-4:-1]
    joints = load(path, ("frames", 17, 3)).astype(np.float64)
    world = rotate(_PC_FROM_CAMERA, joints).astype(np.float32)
    if not np.isfinite(world).all() or not _LEG_M[0] <= leg_length(world) <= _LEG_M[1]:
        raise InputError(
            "wrong-content", f"Expected all joints of a person in metres in {path}; download it again."
        )
    return Clip(f"{subject}_{action}", subject, "mmfi", FPS, world)


def check(clips: Sequence[Clip]) -> None:
    """InputError when the recordings together contradict what is assumed of joints and axes: left and right, by which
    way knees and nose point, and people who stand and face the sensor."""
    joints = np.concatenate([clip.joints for clip in clips])
    sides = chirality(PoseSequence(joints, H36M17, Z_UP))
    if sides.verdict in ("wrong", "legs against arms"):
        raise InputError(
            "sides-swapped",
            "Expected MM-Fi's joints in Human3.6M's order, right leg first, but left and right contradict that: "
            f"{sides}.",
        )
    hips = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    stand, face = upright_share(joints), float((hips[:, 1] < 0).mean())  # who faces -x has the left at -y
    if min(stand, face) < 0.5:
        raise InputError(
            "wrong-axes",
            "Expected people who stand and face MM-Fi's sensor, x right, y down, z away, but only "
            f"{100 * min(stand, face):.0f} % of the frames do.",
        )
