"""BVH files (Biovision hierarchy): a skeleton with names, offsets and channels, then one line of numbers a frame.

Euler channels are applied in their listed order, R = R_1 R_2 R_3, each about an axis of the joint (Meredith &
Maddock, Motion Capture File Formats Explained, Univ. of Sheffield CS-01-11). Position channels stand in for OFFSET.
Units are not in the file.
"""

from __future__ import annotations

from decimal import Decimal
from itertools import count
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.messages import how_many
from .skeletons import (
    UNITS,
    Skeleton,
    h36m17_of_skeleton,
    is_ours,
    leg_length,
    place,
    unit_by_legs,
)

_AXES = "XYZ"
_OWN_LEG_M = (0.3, 1.15)  # thigh and shank, 0.49 of the stature, of an infant of 0.6 m to a tall adult
_WHOLE = 0.005  # of a rate, by which it may be rounded where the digits are few
Channels = dict[int, list[tuple[int, str]]]  # by joint, -1 for End Sites: columns and names
_T_POSE_FRAMES = 10  # CMU's BVH files begin with an added T-pose that was smoothed into the frames after it


class Motion(NamedTuple):
    """joints: (T, 17, 3) H36M17, metres, in the file's axes. unit: the file's, of UNITS. first: the file's frame in
    the first row; those before it are an added T-pose and what was smoothed into it. derived: as of
    `h36m17_of_skeleton`."""

    joints: np.ndarray
    fps: float
    unit: str
    first: int
    derived: dict[str, str]


def read_motion(text: str, unit: str | None = None) -> Motion:
    """The person of a BVH file, in the unit that fits the legs unless `unit` says it; our own files are in metres, and
    may be of children. InputError when none fits, when the file is damaged, and when joints have names that are not in
    use."""
    skeleton, channels, frames, fps = parse(text)
    turning = [
        i for joint, own in channels.items() if joint > 0 for i, name in own if name.endswith("rotation")
    ]
    posed = len(frames) > _T_POSE_FRAMES and np.abs(frames[0, turning]).max() < 1e-6
    first = _T_POSE_FRAMES if posed else 0
    joints, R = pose(skeleton, channels, frames[first:])
    if unit is None:
        leg = leg_length(h36m17_of_skeleton(skeleton, joints, R)[0])
        ours = is_ours(skeleton.names) and _OWN_LEG_M[0] <= leg <= _OWN_LEG_M[1]
        unit = "m" if ours else unit_by_legs(leg)
    body, derived = h36m17_of_skeleton(skeleton, UNITS[unit] * joints, R)
    return Motion(body, fps, unit, first, derived)


def parse(text: str) -> tuple[Skeleton, Channels, np.ndarray, float]:
    """Skeleton (End Sites left out), channels, numbers (T, channels) in degrees and the file's unit, frames per second.
    InputError for what is no BVH."""
    head, separator, motion = text.partition("MOTION")
    if not separator or "HIERARCHY" not in head:
        raise InputError("format-unknown", "expected a BVH file with HIERARCHY and MOTION.")
    try:
        skeleton, channels = _hierarchy(head)
        numbers, fps = _motion(motion, sum(map(len, channels.values())))
    except (ValueError, IndexError) as error:
        raise InputError("file-damaged", f"the BVH file is damaged: {error}.") from None
    _check(skeleton, channels)
    return skeleton, channels, numbers, fps


def _hierarchy(text: str) -> tuple[Skeleton, Channels]:
    """The skeleton and the channels of the part HIERARCHY; ValueError or IndexError where it is damaged."""
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: Channels = {}
    columns = count()
    open_joints: list[int] = []  # -1 for an End Site
    coming = -1
    for line in text.splitlines():
        keyword, *values = line.split() or [""]
        match keyword:
            case "ROOT" | "JOINT":
                parents.append(open_joints[-1] if open_joints else -1)
                coming = len(names)
                names.append(line.strip().partition(" ")[2].strip())
                offsets.append([0.0, 0.0, 0.0])
            case "End":
                coming = -1
            case "{":
                open_joints.append(coming)
            case "}":
                open_joints.pop()
            case "OFFSET" if open_joints[-1] >= 0:
                offsets[open_joints[-1]] = [float(value) for value in values[:3]]
            case "CHANNELS":
                own = values[1 : 1 + int(values[0])]
                channels.setdefault(open_joints[-1], []).extend((next(columns), name) for name in own)
    return Skeleton(tuple(names), tuple(parents), np.array(offsets).reshape(-1, 3)), channels


def _motion(text: str, width: int) -> tuple[np.ndarray, float]:
    """The numbers (T, width) of the part MOTION, and frames per second; ValueError where it is damaged, or holds other
    numbers than it says."""
    count_line, time_line, *lines = (line for line in text.splitlines() if line.strip())
    promised, frame_text = int(count_line.split()[-1]), time_line.split()[-1]
    frame_s = float(frame_text)
    numbers = np.array(" ".join(lines).split(), dtype=float).reshape(-1, max(width, 1))
    timed = frame_s > 0 and 0 < 1 / frame_s < np.inf
    if len(numbers) != promised or not (promised and timed and np.isfinite(numbers).all()):
        raise ValueError(
            f"{how_many(promised, 'frame')} of {how_many(width, 'number')}, {frame_s} s each, are promised, "
            f"{len(numbers)} are there"
        )
    return numbers, _rate(frame_text)


def _check(skeleton: Skeleton, channels: Channels) -> None:
    """InputError for channels twice, for those that there are not, and for other than one root."""
    usual = {f"{axis}{kind}" for axis in _AXES for kind in ("position", "rotation")}
    for own in channels.values():
        names = [name for _, name in own]
        if not set(names) <= usual or len(set(names)) < len(names):
            raise InputError("wrong-content", f"expected known channels, each once, got {', '.join(names)}.")
    if skeleton.parents.count(-1) != 1:
        raise InputError("wrong-content", "expected one root, got none or several.")


def _rate(frame_time: str) -> float:
    """Frames per second of a frame time in seconds as it is written: a whole number where no more than the last digit
    is between them, so that 0.0333333 is 30 and 0.0333667 stays 29.97."""
    fps = 1 / float(frame_time)
    whole, digit = round(fps), 10.0 ** int(Decimal(frame_time).as_tuple().exponent)
    near = abs(fps - whole) < _WHOLE * fps and abs(float(frame_time) - 1 / whole) <= digit
    return whole if near else fps


def pose(skeleton: Skeleton, channels: Channels, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints (T, J, 3) in the file's unit and R_world_from_joint (T, J, 3, 3) of frames (T, channels)."""
    from scipy.spatial.transform import Rotation

    R = np.tile(np.eye(3), (len(frames), len(skeleton.names), 1, 1))
    offsets = np.tile(skeleton.offsets, (len(frames), 1, 1))
    # Joints and their columns, by the order of their axes.
    turned: dict[str, list[tuple[int, tuple[int, ...]]]] = {}
    for joint, own in channels.items():
        if joint < 0:
            continue
        turns = [(i, name[0]) for i, name in own if name.endswith("rotation")]
        if turns:
            columns, axes = zip(*turns, strict=True)  # capitals: about the joint's own, turned axes
            turned.setdefault("".join(axes), []).append((joint, columns))
        for i, name in own:
            if name.endswith("position"):
                offsets[:, joint, _AXES.index(name[0])] = frames[:, i]
    for order, joints in turned.items():
        angles = frames[:, [columns for _, columns in joints]]
        R_alike = Rotation.from_euler(order, angles.reshape(-1, len(order)), degrees=True).as_matrix()
        R[:, [joint for joint, _ in joints]] = R_alike.reshape(*angles.shape[:2], 3, 3)
    return place(skeleton, offsets[:, 0], R, offsets)
