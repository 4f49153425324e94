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
from ....pipeline.core.messages import how_many
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate
from ....pipeline.files.arrays import load
from ....pipeline.files.skeletons import leg_length
from ....pipeline.signals.checks import chirality
from .clips import Clip

PATTERN = "E[0-9][0-9]/S[0-9][0-9]/A[0-9][0-9]/ground_truth.npy"
FPS = 10.0
SUBJECTS = tuple(f"S{i:02d}" for i in range(1, 41))
# Who is tested, of all 40, in all actions: across subjects every fifth, across environments those recorded in E04.
PROTOCOLS = {"S2": set(SUBJECTS[4::5]), "S3": set(SUBJECTS[30:])}

_ACTIONS = tuple(f"A{i:02d}" for i in range(1, 28))
_LEG_M = (0.5, 1.15)
_PC_FROM_CAMERA = PC_CAMERA.basis @ CAMERA.basis.T
# Raising and waving the left hand, and the right one (the toolbox's README).
_ONE_HAND = {"A13": "l", "A17": "l", "A14": "r", "A18": "r"}


def read(path: Path) -> Clip:
    """One recording, in metres, named by subject and action ("S05_A13"). InputError for a file that is no such
    recording."""
    environment, subject, action = path.parts[-4:-1]
    if subject not in SUBJECTS or action not in _ACTIONS or environment != _environment(subject):
        raise InputError("name-unknown", f"MM-Fi has no {environment}/{subject}/{action}.")
    joints = load(path, ("frames", 17, 3))
    if joints.dtype.kind != "f":
        raise InputError("wrong-content", f"expected numbers with fractions, got {joints.dtype}.")
    if not np.isfinite(joints).all():
        raise InputError("wrong-content", "expected joints in every frame, got NaN or infinite ones.")
    world = rotate(_PC_FROM_CAMERA, joints.astype(np.float64)).astype(np.float32)
    if not _LEG_M[0] <= leg_length(world) <= _LEG_M[1]:
        raise InputError("wrong-axes", f"expected metres, got legs {leg_length(world):.3g} long.")
    return Clip(f"{subject}_{action}", subject, "mmfi", FPS, world)


def check(clips: Sequence[Clip]) -> None:
    """InputError when the recordings together contradict what is assumed of joints and axes: left and right, by which
    way knees and nose point and by which hand moves in A13, A14, A17 and A18, and people who face the sensor."""
    joints = np.concatenate([clip.joints for clip in clips])
    sides = chirality(PoseSequence(joints, H36M17, Z_UP))
    of_one_hand = [clip for clip in clips if clip.name[-3:] in _ONE_HAND]
    moves = [_hand_that_moves(clip) == _ONE_HAND[clip.name[-3:]] for clip in of_one_hand]
    if sides.verdict in ("wrong", "legs against arms") or (moves and np.mean(moves) < 0.5):
        raise InputError(
            "sides-swapped",
            "Expected MM-Fi's joints in Human3.6M's order, right leg first, x right, y down, z away, but left and "
            f"right contradict that: {sides}; the hand that should move does in {sum(moves)} of "
            f"{how_many(len(moves), 'clip')} of one hand.",
        )
    hips = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    facing = float((hips[:, 1] < 0).mean())  # who faces -x has the left at -y
    if facing < 0.5:
        raise InputError(
            "wrong-axes",
            "Expected people who face MM-Fi's sensor, x right, y down, z away, but only "
            f"{100 * facing:.0f} % of the frames do.",
        )


def _hand_that_moves(clip: Clip) -> str:
    """ "l" or "r", whose wrist goes further about its shoulder."""

    def way(side: str) -> float:
        arm = clip.joints[:, H36M17.index(f"{side}_wrist")] - clip.joints[:, H36M17.index(f"{side}_shoulder")]
        return float(np.linalg.norm(arm - arm.mean(axis=0), axis=-1).mean())

    return max("lr", key=way)


def _environment(subject: str) -> str:
    return f"E{(int(subject[1:]) - 1) // 10 + 1:02d}"
