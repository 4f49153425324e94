"""Motion capture as clips of one person each: the file of many that `pcnet3d lab mocap` writes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.layouts import H36M17, LEG
from ..files.arrays import load_all
from ..files.markers import Up
from ..files.skeletons import leg_length

_ARRAYS = ("joints", "root", "clip_start", "clip_name", "subject", "source", "fps", "joint_names")
_LEGS = tuple(f"{side}_{joint}" for side in "lr" for joint in LEG)


@dataclass(frozen=True, eq=False)
class Clip:
    """One take of one person.

    joints: (T, 17, 3) float32 metres, H36M17, world axes with +Z up (frames.Z_UP), right-handed.
    source: the skeleton it comes with; those of OWN_SKELETON have the subject's own proportions.
    """

    name: str
    subject: str
    source: str
    fps: float
    joints: np.ndarray

    def __len__(self) -> int:
        return len(self.joints)


def read_mocap(path: Path) -> tuple[Clip, ...]:
    """All clips of a motion capture file. InputError when it is missing, damaged or holds other arrays.

    The file holds joints relative to the pelvis in world orientation and the pelvis apart (the data's README).
    """
    if not path.exists():
        raise InputError("cannot-open", f"Expected motion capture at {path}, found nothing there.")
    arrays = load_all(path, *_ARRAYS)
    start, frames = arrays["clip_start"], len(arrays["root"])
    shapes = {
        "joints": (frames, len(H36M17), 3), "root": (frames, 3), "fps": (), "clip_start": (len(start),),
        **dict.fromkeys(("clip_name", "subject", "source"), (len(start) - 1,)),
    }  # fmt: skip
    kinds = {"joints": "f", "root": "f", "fps": "fiu", "clip_start": "iu"}
    wrong = [name for name, shape in shapes.items() if arrays[name].shape != shape]
    wrong += [name for name, kind in kinds.items() if arrays[name].dtype.kind not in kind]
    if tuple(map(str, arrays["joint_names"])) != H36M17.joints:
        wrong.append("joint_names")
    if not wrong and (start[0] != 0 or start[-1] != frames or (np.diff(start.astype(float)) <= 0).any()):
        wrong.append("clip_start")
    if not wrong and not 0 < arrays["fps"] < np.inf:
        wrong.append("fps")
    if wrong:
        raise InputError(
            "wrong-content",
            f"Expected clips of motion capture of H36M17, as `pcnet3d lab mocap` writes them, in {path}, got others: "
            f"see {', '.join(wrong)}.",
        )
    world = (arrays["joints"] + arrays["root"][:, None]).astype(np.float32)
    if not np.isfinite(world).all():
        raise InputError(
            "file-damaged",
            f"Expected finite joints in {path}, got NaN or infinite ones; the file is damaged.",
        )
    return tuple(
        Clip(
            name=str(arrays["clip_name"][i]),
            subject=str(arrays["subject"][i]),
            source=str(arrays["source"][i]),
            fps=float(arrays["fps"]),
            joints=world[start[i] : start[i + 1]],
        )
        for i in range(len(start) - 1)
    )


def z_up(joints: np.ndarray, up: Up) -> np.ndarray:
    """Points (..., 3) of a right-handed Y-up or Z-up file in Z-up axes; y: (x, y, z) -> (x, -z, y), a rotation."""
    return joints if up == "z" else joints[..., [0, 2, 1]] * np.array([1, -1, 1])


def upright_share(joints: np.ndarray) -> float:
    """Share of frames of joints (T, 17, 3), +Z up, whose head is above both feet by half a leg; of those that know the
    head and both legs, NaN where none does. Where no frame has the head, the middle of the hips stands for it."""
    top = "head" if np.isfinite(joints[:, H36M17.index("head")]).any() else "pelvis"
    joints = joints[np.isfinite(joints[:, H36M17.indices((top, *_LEGS))]).all(axis=(1, 2))]
    if not len(joints):
        return float("nan")
    highest, feet = joints[:, H36M17.index(top), 2], joints[:, H36M17.indices(("l_ankle", "r_ankle")), 2]
    return float((highest > feet.max(axis=1) + leg_length(joints) / 2).mean())
