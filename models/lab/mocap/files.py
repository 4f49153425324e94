"""Files of motion capture as clips: BVH and NumPy files of joints, and the file of many clips that the lab trains on.

How such a file is to be read, who is in it, its axes and unit, and whether its limbs are a person's.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import Z_UP
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import PoseSequence
from ....pipeline.files.arrays import write_arrays
from ....pipeline.files.bvh import read_motion
from ....pipeline.files.markers import Up, read_joints
from ....pipeline.files.skeletons import LEG_M, UNITS, h36m17_named, leg_length
from ....pipeline.reading.mocap import Clip, z_up
from ....pipeline.signals.checks import chirality

BVH_FILES, JOINTS_FILES = "**/*.[bB][vV][hH]", "**/*.[nN][pP][zZ]"
_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in "lr"
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_MIN_VOTES = 20  # bent knees, before they say anything
_BACKWARD = 0.2  # share of knees bent forward at or below which left and right are not what the file says
_LIMB_SPREAD = 0.15  # of optical capture it is below 0.01, of markerless capture up to 0.1


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
    """A clip at its own frame rate, and what was assumed or left out."""

    clip: Clip
    notes: tuple[str, ...] = ()


def label(path: Path, folder: Path, pattern: str | None) -> tuple[str, str]:
    """Subject and clip name of a file; the name is the subject, "_" and the rest.

    Without a pattern the subject is the file name up to the first "_", or else the name of the file's folder.
    InputError when the pattern is not found in the path.
    """
    if pattern:
        try:
            match = re.search(pattern, path.relative_to(folder).as_posix())
        except re.error as error:
            raise InputError(
                "bad-value", f"Expected a regular expression for the subject, got '{pattern}': {error}."
            ) from None
        if not (match and match.groups() and match[1]):
            raise InputError(
                "bad-value", f"the pattern '{pattern}' finds no subject (its first group) in the path."
            )
        subject = match[1]
    elif "_" in path.stem.strip("_"):
        subject = path.stem.partition("_")[0]
    else:
        subject = path.stem if path.parent == folder else path.parent.name
    return subject.replace("_", "-"), joined(subject, path.stem)


def joined(subject: str, stem: str) -> str:
    """A clip's name: the subject, "_" and what the stem of the file says beyond it."""
    rest = stem.removeprefix(f"{subject}_")
    return f"{subject.replace('_', '-')}_{rest}"


def require_plausible(joints: np.ndarray) -> None:
    """InputError when joints (T, 17, 3), metres, lack one, or are not those of a person whose limbs keep their
    length."""
    if len(joints) == 0 or not np.isfinite(joints).all():
        raise InputError("nothing-usable", "expected frames with all joints, got none, or NaN among them.")
    leg = leg_length(joints)
    if not LEG_M[0] * 0.5 <= leg <= LEG_M[1] * 1.1:
        raise InputError(
            "wrong-axes", f"expected metres, got legs {leg:.4g} long; give the unit with --unit."
        )
    for start, end in _LIMBS:
        length = np.linalg.norm(joints[:, H36M17.index(start)] - joints[:, H36M17.index(end)], axis=-1)
        if length.std() > _LIMB_SPREAD * length.mean():
            raise InputError(
                "wrong-content", f"the bone from {start} to {end} changes its length by more than 15 %."
            )
    sides = chirality(PoseSequence(joints.astype(np.float32), H36M17, Z_UP))
    # Not the verdict: where the nose is made from left and right, it agrees with them whatever they are.
    if sides.verdict == "legs against arms":
        raise InputError(
            "sides-swapped",
            "left and right of the shoulders contradict those of the hips; check the joints' names.",
        )
    if sides.knee_votes >= _MIN_VOTES and sides.knees <= _BACKWARD:
        raise InputError(
            "sides-swapped",
            f"left and right look exchanged, or the axes are left-handed: the knees bend forward in {sides.knees:.0%} "
            f"of {sides.knee_votes} frames.",
        )


def read_text(path: Path) -> str:
    """InputError when the file cannot be read as text."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError("cannot-open", f"{error.strerror or error}.") from None


def bvh_clip(path: Path, folder: Path, how: How) -> Found:
    """One clip; +Y is up unless `how` says otherwise, and the unit the one that fits the legs. InputError otherwise."""
    motion = read_motion(read_text(path), how.unit)
    notes = []
    if motion.first:
        notes.append(f"the T-pose and the {motion.first - 1} frames after it are left out")
    if how.unit is None:
        notes.append(f"unit {motion.unit}, by the length of the legs")
    joints = z_up(motion.joints, how.up or "y").astype(np.float32)
    require_plausible(joints)
    subject, name = label(path, folder, how.subject)
    return Found(Clip(name, subject, "bvh", how.fps or motion.fps, joints), tuple(notes))


def joints_clip(path: Path, folder: Path, how: How) -> Found:
    """One clip; metres and +Z up, as AMASS has it, unless `how` says otherwise. InputError for anything
    else."""
    held = read_joints(path, how.fps)
    joints = held.points * UNITS[how.unit or "m"]
    joints = z_up(h36m17_named(joints, held.names), how.up or held.up).astype(np.float32)
    require_plausible(joints)
    subject, name = label(path, folder, how.subject)
    fps = 1 / float(held.time_s[1]) if len(joints) > 1 else 1.0  # one frame has no rate
    return Found(Clip(name, subject, "joints", fps, joints))


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
