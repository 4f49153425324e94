"""MM-Fi (Yang et al. 2023): E0x/Sxx/Axx/ground_truth.npy, 40 people, 27 actions, 10 frames a second, one camera.

Joints are mapped by index, order A of formats.md; the names that are printed for this data set elsewhere are mirrored
(formats.md section 8.1). A clip has the paper's axes, x away from the sensor, y left, z up, as the sensor stands: how
it was mounted is not published, so +Z is up but for the sensor's own tilt.

The protocols are those of the data set's toolbox: github.com/ybhbingo/MMFi_dataset @ 269f648, mmfi_lib/mmfi.py
(decode_config) and config.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA, PC_CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many
from ....pipeline.core.rotations import rotate
from ....pipeline.files.arrays import load
from ....pipeline.files.skeletons import leg_length
from ....pipeline.reading.mocap import Clip, upright_share
from .files import Found, How

PATTERN = "E[0-9][0-9]/S[0-9][0-9]/A[0-9][0-9]/ground_truth.npy"
FPS = 10.0
SUBJECTS = tuple(f"S{i:02d}" for i in range(1, 41))
ACTIONS = tuple(f"A{i:02d}" for i in range(1, 28))
DAILY = ("A02", "A03", "A04", "A05", "A13", "A14", "A17", "A18", "A19", "A20", "A21", "A22", "A23", "A27")

Protocol = Literal["S1", "S2", "S3"]  # random, across subjects, across environments
Activities = Literal["P1", "P2", "P3"]  # daily, rehabilitation, all

_LEG_M = (0.5, 1.15)
_PC_FROM_CAMERA = PC_CAMERA.basis @ CAMERA.basis.T
# Raising and waving the left hand, and the right one (the toolbox's README).
_ONE_HAND = {"A13": "l_wrist", "A17": "l_wrist", "A14": "r_wrist", "A18": "r_wrist"}


class Split(NamedTuple):
    """(subject, action) of both parts."""

    train: frozenset[tuple[str, str]]
    test: frozenset[tuple[str, str]]


def protocol(name: str, activities: Activities = "P3") -> Split:
    """S1: for every action, 32 of the 40 subjects by numpy's permutation, seeded with the action's place in the list.
    S2: tested on every fifth subject, S05 to S40. S3: tested on S31 to S40, who were recorded in E04.

    S1 has every subject in both parts, with other actions. InputError for another name.
    """
    if name not in get_args(Protocol) or activities not in get_args(Activities):
        raise InputError(
            "bad-value", f"Expected MM-Fi's protocols S1 to S3 and P1 to P3, got {name} and {activities}."
        )
    actions = [a for a in ACTIONS if activities == "P3" or (a in DAILY) == (activities == "P1")]
    train, test = set(), set()
    for place, action in enumerate(actions):
        if name == "S1":
            order = np.random.RandomState(place).permutation(len(SUBJECTS))
            held_out = {SUBJECTS[i] for i in order[int(0.8 * len(SUBJECTS)) :]}
        else:
            held_out = set(SUBJECTS[4::5] if name == "S2" else SUBJECTS[30:])
        for subject in SUBJECTS:
            (test if subject in held_out else train).add((subject, action))
    return Split(frozenset(train), frozenset(test))


def read(path: Path, folder: Path, how: How) -> Found:
    """One recording, in metres, named by subject and action ("S05_A13"). InputError for a file that is no such
    recording."""
    if how != How():
        raise InputError(
            "option-conflict",
            "units, axes, frame rate and subjects of MM-Fi are known; leave the options out.",
        )
    environment, subject, action = path.parts[-4:-1]
    if subject not in SUBJECTS or action not in ACTIONS or environment != _environment(subject):
        raise InputError("name-unknown", f"MM-Fi has no {environment}/{subject}/{action}.")
    joints = load(path, ("frames", 17, 3))
    if joints.dtype.kind != "f":
        raise InputError("wrong-content", f"expected numbers with fractions, got {joints.dtype}.")
    if not np.isfinite(joints).all():
        raise InputError("wrong-content", "expected joints in every frame, got NaN or infinite ones.")
    world = rotate(_PC_FROM_CAMERA, joints.astype(np.float64)).astype(np.float32)
    if not _LEG_M[0] <= leg_length(world) <= _LEG_M[1]:
        raise InputError("wrong-axes", f"expected metres, got legs {leg_length(world):.3g} long.")
    return Found(Clip(f"{subject}_{action}", subject, "mmfi", FPS, world))


def check(clips: Sequence[Clip]) -> None:
    """InputError when the recordings together contradict what is assumed of joints and axes: left and right (by which
    way knees and nose point, and by which hand moves in A13, A14, A17, A18), people upright, facing the sensor."""
    from ....pipeline.core.frames import Z_UP
    from ....pipeline.core.pose import PoseSequence
    from ....pipeline.signals.checks import chirality

    joints = np.concatenate([clip.joints for clip in clips])
    seen = chirality(PoseSequence(joints, H36M17, Z_UP))
    right_hand = [moved_more(clip) == hand for clip in clips if (hand := _ONE_HAND.get(clip.name[-3:]))]
    hands = (
        "no action with one hand"
        if not right_hand
        else f"{sum(right_hand)} of {how_many(len(right_hand), 'clip')}"
    )
    if seen.verdict in ("wrong", "legs against arms") or (right_hand and np.mean(right_hand) < 0.5):
        raise InputError(
            "sides-swapped",
            "Expected MM-Fi's joints in Human3.6M's order, right leg first, x right, y down, z away, but left and "
            f"right contradict that: {seen}; the hand that should move does in {hands}.",
        )
    hips = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    facing = float((hips[:, 1] < 0).mean())  # who faces -x has the left at -y
    upright = upright_share(joints)
    if facing < 0.5 or upright < 0.5:
        raise InputError(
            "wrong-axes",
            "Expected people who stand and face MM-Fi's sensor, x right, y down, z away, but only "
            f"{100 * upright:.0f} % of the frames are upright and {100 * facing:.0f} % face it.",
        )


def moved_more(clip: Clip) -> str:
    """ "l_wrist" or "r_wrist", whichever travels further against its shoulder."""

    def way(side: str) -> float:
        arm = clip.joints[:, H36M17.index(f"{side}_wrist")] - clip.joints[:, H36M17.index(f"{side}_shoulder")]
        return float(np.linalg.norm(arm - arm.mean(axis=0), axis=-1).mean())

    return "l_wrist" if way("l") > way("r") else "r_wrist"


def _environment(subject: str) -> str:
    return f"E{(int(subject[1:]) - 1) // 10 + 1:02d}"
