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
# Raising and waving the left hand, and the right one (the toolbox's README).
_ONE_HAND = {"A13": "l", "A17": "l", "A14": "r", "A18": "r"}


def read_tree(tree: Path) -> tuple[list[Clip], list[str]]:
    """The recordings of a tree, named by subject and action ("S05_A13"), and a sentence for each that was left out.
    InputError where there is none, and of recordings that contradict what is assumed of their joints."""
    clips: list[Clip] = []
    notes: list[str] = []
    files = sorted({*tree.glob(PATTERN), *tree.glob(f"*/{PATTERN}")})
    for path in each(files, "files", len(files)):
        try:
            clips.append(_read(path))
        except InputError as error:
            notes.append(f"left out {error}" if str(path) in str(error) else f"left out {path}: {error}")
    if not clips:
        raise InputError(
            "nothing-usable", f"Expected recordings as {PATTERN} in {tree}{f'; {notes[0]}' if notes else '.'}"
        )
    check(clips)
    return clips, notes


def _read(path: Path) -> Clip:
    """One recording, in metres. InputError for a file that is no such recording."""
    environment, subject, action = path.parts[-4:-1]
    if subject not in SUBJECTS or environment != f"E{(int(subject[1:]) - 1) // 10 + 1:02d}":
        raise InputError("name-unknown", f"MM-Fi has no {environment}/{subject}.")
    joints = load(path, ("frames", 17, 3)).astype(np.float64)
    if not np.isfinite(joints).all():
        raise InputError("wrong-content", "expected joints in every frame, got NaN or infinite ones.")
    world = rotate(_PC_FROM_CAMERA, joints).astype(np.float32)
    if not _LEG_M[0] <= leg_length(world) <= _LEG_M[1]:
        raise InputError("wrong-axes", f"expected metres, got legs {leg_length(world):.3g} long.")
    return Clip(f"{subject}_{action}", subject, "mmfi", FPS, world)


def check(clips: Sequence[Clip]) -> None:
    """InputError when the recordings together contradict what is assumed of joints and axes: left and right, by which
    way knees and nose point and by which hand moves in A13, A14, A17 and A18, and people who stand and face the
    sensor."""
    joints = np.concatenate([clip.joints for clip in clips])
    sides = chirality(PoseSequence(joints, H36M17, Z_UP))
    moves = [_hand_that_moves(clip) == hand for clip in clips if (hand := _ONE_HAND.get(clip.name[-3:]))]
    if sides.verdict in ("wrong", "legs against arms") or (moves and np.mean(moves) < 0.5):
        raise InputError(
            "sides-swapped",
            "Expected MM-Fi's joints in Human3.6M's order, right leg first, but left and right contradict that: "
            f"{sides}; the hand that should move does in {sum(moves)} of {how_many(len(moves), 'clip')} of one hand.",
        )
    hips = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    stand, face = upright_share(joints), float((hips[:, 1] < 0).mean())  # who faces -x has the left at -y
    if min(stand, face) < 0.5:
        raise InputError(
            "wrong-axes",
            "Expected people who stand and face MM-Fi's sensor, x right, y down, z away, but only "
            f"{100 * min(stand, face):.0f} % of the frames do.",
        )


def _hand_that_moves(clip: Clip) -> str:
    """ "l" or "r", whose wrist goes further about its shoulder."""

    def way(side: str) -> float:
        arm = clip.joints[:, H36M17.index(f"{side}_wrist")] - clip.joints[:, H36M17.index(f"{side}_shoulder")]
        return float(np.linalg.norm(arm - arm.mean(axis=0), axis=-1).mean())

    return max("lr", key=way)
