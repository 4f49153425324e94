"""What readers of motion capture files share: how a file is to be read, who is in it, axes, units, plausibility."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from ...core.errors import InputError
from ...core.frames import Z_UP
from ...core.layouts import H36M17, LEG
from ...core.pose import PoseSequence
from ...files.skeletons import LEG_M, leg_length
from ...signals.checks import chirality
from .clip import Clip

_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in "lr"
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)
_LEGS = tuple(f"{side}_{joint}" for side in "lr" for joint in LEG)
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
    up: Literal["y", "z"] | None = None
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


def z_up(joints: np.ndarray, up: Literal["y", "z"]) -> np.ndarray:
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
