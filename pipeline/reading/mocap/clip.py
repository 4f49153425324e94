"""A file of motion capture clips: what `pcnet3d lab mocap` writes, and the project's own data come as."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.layouts import H36M17
from ...files.arrays import load_all, write_arrays

_ARRAYS = ("joints", "root", "clip_start", "clip_name", "subject", "source", "fps", "joint_names")


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
    names = tuple(str(name) for name in arrays["joint_names"])
    if names != H36M17.joints:
        raise InputError("wrong-content", f"Expected the joints of H36M17 in {path}, got {', '.join(names)}.")
    start, frames = arrays["clip_start"], len(arrays["root"])
    shapes = {
        "joints": (frames, len(H36M17), 3), "root": (frames, 3), "fps": (), "clip_start": (len(start),),
        **dict.fromkeys(("clip_name", "subject", "source"), (len(start) - 1,)),
    }  # fmt: skip
    wrong = [f"{name} {arrays[name].shape}" for name, shape in shapes.items() if arrays[name].shape != shape]
    if wrong or any(arrays[name].dtype.kind not in "fiu" for name in ("joints", "root", "fps", "clip_start")):
        raise InputError(
            "wrong-content",
            f"Expected clips of {frames} frames in {path}, got {', '.join(wrong) or 'no numbers'}.",
        )
    if (
        start[0] != 0
        or start[-1] != frames
        or start.dtype.kind == "f"
        or (np.diff(start.astype(float)) <= 0).any()
    ):
        raise InputError(
            "wrong-content", f"Expected clip_start to go up from 0 to {frames} in {path}; it does not."
        )
    if not 0 < arrays["fps"] < np.inf:
        raise InputError("wrong-content", f"Expected a frame rate in {path}, got {arrays['fps']}.")
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


def write_mocap(path: Path, clips: Sequence[Clip]) -> None:
    """What read_mocap reads, rounded to 0.1 mm. InputError when the clips' frame rates differ or nothing can be
    written there."""
    if len({clip.fps for clip in clips}) != 1:
        raise InputError("files-apart", "Expected clips of one frame rate to write into one file.")
    world = np.concatenate([clip.joints for clip in clips]).astype(np.float64)
    root = world[:, H36M17.index("pelvis")]
    try:
        write_arrays(
            path,
            joints=(world - root[:, None]).round(4).astype(np.float32),
            root=root.round(4).astype(np.float32),
            clip_start=np.cumsum([0, *map(len, clips)]),
            clip_name=np.array([clip.name for clip in clips]),
            subject=np.array([clip.subject for clip in clips]),
            source=np.array([clip.source for clip in clips]),
            fps=np.array(clips[0].fps),
            joint_names=np.array(H36M17.joints),
        )
    except OSError as error:
        raise InputError(
            "cannot-write", f"Cannot write {path}: {error.strerror}; choose another -o FILE."
        ) from None
