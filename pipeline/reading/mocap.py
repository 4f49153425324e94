"""Motion capture as clips: files as `pcnet3d lab mocap` writes them, BVH files and NumPy files of joints.

How such a file is to be read, who is in it, its axes and unit, and whether its limbs are a person's.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.frames import Z_UP
from ..core.layouts import H36M17, LEG
from ..core.pose import PoseSequence
from ..files.arrays import load_all, write_arrays
from ..files.bvh import read_motion
from ..files.markers import Up, read_joints
from ..files.skeletons import LEG_M, UNITS, h36m17_named, h36m17_of_limbs, leg_length
from ..signals.checks import chirality

BVH_FILES, JOINTS_FILES = "**/*.[bB][vV][hH]", "**/*.[nN][pP][zZ]"
_ARRAYS = ("joints", "root", "clip_start", "clip_name", "subject", "source", "fps", "joint_names")
_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in "lr"
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_LEGS = tuple(f"{side}_{joint}" for side in "lr" for joint in LEG)
_MIN_VOTES = 20  # bent knees, before they say anything
_BACKWARD = 0.2  # share of knees bent forward at or below which left and right are not what the file says
_LIMB_SPREAD = 0.15  # of optical capture it is below 0.01, of markerless capture up to 0.1


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


@dataclass(frozen=True)
class How:
    """What the user says of the files; None leaves it to the reader.

    unit: of UNITS ("asf" is the one of CMU's skeletons, 0.0254 / 0.45 m). up: the file's vertical axis.
    fps: of files that do not say it. subject: a regular expression on the path, its first group names the subject.
    """

    unit: str | None = None
    up: Up | None = None
    fps: float | None = None
    subject: str | None = None


class Found(NamedTuple):
    """A clip at its own frame rate, what was assumed or left out, and the file's frame in the clip's first row."""

    clip: Clip
    notes: tuple[str, ...] = ()
    first: int = 0


def label(path: Path, folder: Path, pattern: str | None) -> tuple[str, str]:
    """Subject and clip name of a file; the name is the subject, "_" and the rest.

    Without a pattern the subject is the file name up to the first "_", or else the name of the file's folder.
    InputError when the pattern is not found in the path.
    """
    if pattern:
        try:
            found = re.search(pattern, path.relative_to(folder).as_posix())
        except re.error as error:
            raise InputError(
                "bad-value", f"Expected a regular expression for the subject, got '{pattern}': {error}."
            ) from None
        if not (found and found.groups() and found[1]):
            raise InputError(
                "bad-value", f"the pattern '{pattern}' finds no subject (its first group) in the path."
            )
        subject = found[1]
    elif "_" in path.stem.strip("_"):
        subject = path.stem.partition("_")[0]
    else:
        subject = path.stem if path.parent == folder else path.parent.name
    return subject.replace("_", "-"), joined(subject, path.stem)


def joined(subject: str, stem: str) -> str:
    """A clip's name: the subject, "_" and what the stem of the file says beyond it."""
    rest = stem.removeprefix(f"{subject}_")
    return f"{subject.replace('_', '-')}_{rest}"


def z_up(joints: np.ndarray, up: Up) -> np.ndarray:
    """Points (..., 3) of a right-handed Y-up or Z-up file in Z-up axes; y: (x, y, z) -> (x, -z, y), a rotation."""
    return joints if up == "z" else joints[..., [0, 2, 1]] * np.array([1, -1, 1])


def require_plausible(joints: np.ndarray) -> None:
    """InputError when joints (T, 17, 3), metres, lack one, or are not those of a person whose limbs keep their
    length."""
    if len(joints) == 0 or not np.isfinite(joints).all():
        raise InputError("nothing-usable", "expected frames with all joints, got none, or NaN among them.")
    require_a_person(joints)


def require_a_person(joints: np.ndarray) -> None:
    """InputError when the limbs of joints (T, 17, 3), metres, are not a person's or change their length; what is NaN
    is not judged."""
    leg = leg_length(joints)
    if not LEG_M[0] * 0.5 <= leg <= LEG_M[1] * 1.1:
        raise InputError(
            "wrong-axes", f"expected metres, got legs {leg:.4g} long; give the unit with --unit."
        )
    for start, end in _LIMBS:
        length = np.linalg.norm(joints[:, H36M17.index(start)] - joints[:, H36M17.index(end)], axis=-1)
        length = length[np.isfinite(length)]
        if len(length) and length.std() > _LIMB_SPREAD * length.mean():
            raise InputError(
                "wrong-content", f"the bone from {start} to {end} changes its length by more than 15 %."
            )
    seen = chirality(PoseSequence(joints.astype(np.float32), H36M17, Z_UP))
    # Not the verdict: where the nose is made from left and right, it agrees with them whatever they are.
    if seen.verdict == "legs against arms":
        raise InputError(
            "sides-swapped",
            "left and right of the shoulders contradict those of the hips; check the joints' names.",
        )
    if seen.knee_votes >= _MIN_VOTES and seen.knees <= _BACKWARD:
        raise InputError(
            "sides-swapped",
            f"left and right look exchanged, or the axes are left-handed: the knees bend forward in {seen.knees:.0%} "
            f"of {seen.knee_votes} frames.",
        )


def upright_share(joints: np.ndarray) -> float:
    """Share of frames of joints (T, 17, 3), +Z up, whose head is above both feet by half a leg; of those that know the
    head and both legs, NaN where none does. Where no frame has the head, the middle of the hips stands for it."""
    top = "head" if np.isfinite(joints[:, H36M17.index("head")]).any() else "pelvis"
    joints = joints[np.isfinite(joints[:, H36M17.indices((top, *_LEGS))]).all(axis=(1, 2))]
    if not len(joints):
        return float("nan")
    highest, feet = joints[:, H36M17.index(top), 2], joints[:, H36M17.indices(("l_ankle", "r_ankle")), 2]
    return float((highest > feet.max(axis=1) + leg_length(joints) / 2).mean())


def read_text(path: Path) -> str:
    """InputError when the file cannot be read as text."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError("cannot-open", f"{error.strerror or error}.") from None


def bvh_clip(path: Path, folder: Path, how: How) -> Found:
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
    return Found(Clip(name, subject, "bvh", how.fps or found.fps, joints), tuple(notes), found.first)


def joints_clip(path: Path, folder: Path, how: How, parts: bool = False) -> Found:
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
