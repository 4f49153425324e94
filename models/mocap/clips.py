"""Motion capture as training and test material: clips of world joints, their subjects and their split."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ...pipeline.canonical import LYING_DEG, trunk_lean_deg
from ...pipeline.errors import InputError
from ...pipeline.files.arrays import load_all
from ...pipeline.files.atomic import whole_file
from ...pipeline.layouts import H36M17

Subjects = Literal["train", "train-a", "train-b", "val", "test", "hdm05", "tennis"]
OWN_SKELETON = ("asfamc", "max", "markers", "accad-bvh", "arena")  # sources with the people's own proportions

# The train subjects in two halves of about equal minutes (46.1 and 46.3; of tennis 15.3 and 13.8, five players each),
# for cross-fitted lifts. 60 and 61 dance together and stay together, as the data's README asks; x are takes of unknown
# subjects.
_TRAIN_A = frozenset({
    "02", "05", "11", "118", "16", "35", "38", "60", "61", "accad-f1",
    *(f"tennis-{player}" for player in ("jdescobar", "jpcardona", "jsgiraldo", "mrios", "secheverri")),
})  # fmt: skip
_EDITION = "third"
_TENNIS = "tennis_mocap"
_FILES = ("cmu_mocap", "accad_mocap", _TENNIS)  # of that edition, all of which splits.json lists
_PARTS = ("train", "val", "test")
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


def subject_of(name: str) -> str:
    """What a split calls the person in the clip of that name: the name up to its first "_"."""
    return name.partition("_")[0]


def person(clip: Clip) -> str | None:
    """Who is in a clip, as a split calls them. None for the takes of CMU of which nobody knows whose they are (x_...):
    each may be of anybody, also of one who is in other clips."""
    return None if clip.subject.startswith(("x_", "xq_")) else subject_of(clip.name)


def data_set(clip: Clip) -> Literal["cmu", "accad", "tennis"]:
    """Which of the data sets that splits.json divides a clip is from: the names of CMU's alone begin with no word for
    it."""
    name = clip.name
    return "accad" if name.startswith("accad-") else "tennis" if name.startswith("tennis-") else "cmu"


def data_folder() -> Path:
    """The folder of motion capture that PCNET3D_DATA names. InputError where it is not set, or has none."""
    named = os.environ.get("PCNET3D_DATA")
    if not named:
        raise InputError("Expected motion capture; set PCNET3D_DATA to the folder that has cmu_mocap.npz.")
    if not (Path(named) / "cmu_mocap.npz").is_file():
        raise InputError(f"Expected cmu_mocap.npz in {named}; set PCNET3D_DATA to the folder that has it.")
    return Path(named)


def read_mocap(path: Path) -> tuple[Clip, ...]:
    """All clips of a motion capture file. InputError when it is missing, damaged or holds other arrays.

    The file holds joints relative to the pelvis in world orientation and the pelvis apart (the data's README).
    """
    if not path.exists():
        raise InputError(f"Expected motion capture at {path}, found nothing there.")
    arrays = load_all(path, *_ARRAYS)
    names = tuple(str(name) for name in arrays["joint_names"])
    if names != H36M17.joints:
        raise InputError(f"Expected the joints of H36M17 in {path}, got {', '.join(names)}.")
    start, frames = arrays["clip_start"], len(arrays["root"])
    shapes = {
        "joints": (frames, len(H36M17), 3), "root": (frames, 3), "fps": (), "clip_start": (len(start),),
        **dict.fromkeys(("clip_name", "subject", "source"), (len(start) - 1,)),
    }  # fmt: skip
    wrong = [f"{name} {arrays[name].shape}" for name, shape in shapes.items() if arrays[name].shape != shape]
    if wrong or any(arrays[name].dtype.kind not in "fiu" for name in ("joints", "root", "fps", "clip_start")):
        raise InputError(
            f"Expected clips of {frames} frames in {path}, got {', '.join(wrong) or 'no numbers'}."
        )
    if (
        start[0] != 0
        or start[-1] != frames
        or start.dtype.kind == "f"
        or (np.diff(start.astype(float)) <= 0).any()
    ):
        raise InputError(f"Expected clip_start to go up from 0 to {frames} in {path}; it does not.")
    if not 0 < arrays["fps"] < np.inf:
        raise InputError(f"Expected a frame rate in {path}, got {arrays['fps']}.")
    world = (arrays["joints"] + arrays["root"][:, None]).astype(np.float32)
    if not np.isfinite(world).all():
        raise InputError(f"Expected finite joints in {path}, got NaN or infinite ones; the file is damaged.")
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
        raise InputError("Expected clips of one frame rate to write into one file.")
    world = np.concatenate([clip.joints for clip in clips]).astype(np.float64)
    root = world[:, H36M17.index("pelvis")]
    try:
        with whole_file(path) as partial, open(partial, "wb") as file:
            np.savez_compressed(
                file,
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
        raise InputError(f"Cannot write {path}: {error.strerror}; choose another -o FILE.") from None


def read_clips(subjects: Subjects, folder: Path | None = None) -> tuple[Clip, ...]:
    """The clips of one part of the project's own data, split by subject.

    "train" and "val" are those of every file that splits.json lists (CMU, ACCAD, tennis); "test" is CMU's; "train-a"
    and "train-b" are two disjoint halves of the train subjects; "hdm05" is all of HDM05 and "tennis" the test players
    of tennis, test sets of their own of other people and movements, other laboratories and body models. InputError for
    another name, or where the data is not, or is of an older edition.
    """
    if subjects not in get_args(Subjects):
        raise InputError(f"Expected subjects of {', '.join(get_args(Subjects))}; got '{subjects}'.")
    folder = folder or data_folder()
    split = _read_split(folder)
    if subjects == "hdm05":
        return read_mocap(folder / "hdm05_subset.npz")
    members = _members(split, subjects, folder / "splits.json")
    files = [folder / f"{name}.npz" for name in _FILES if members.get(name)]
    clips = tuple(
        clip for path in files for clip in read_mocap(path)
        if (key := subject_of(clip.name)) in members[path.stem]
        and (subjects not in ("train-a", "train-b") or (key in _TRAIN_A) == (subjects == "train-a"))
    )  # fmt: skip
    if not clips:
        raise InputError(
            f"Expected clips of {subjects} subjects in {', '.join(map(str, files)) or folder}, but there are none of "
            "those that splits.json lists."
        )
    return clips


def _read_split(folder: Path) -> dict[str, dict[str, set[str]]]:
    """{file: {part: subjects}} of splits.json. InputError when it is no split, or the folder holds an older edition."""
    path = folder / "splits.json"
    try:
        listed = json.loads(path.read_text(encoding="utf-8"))
        split = {
            name: {key: set(listed[name].get(key, ())) for key in _PARTS} for name in _FILES if name in listed
        }
    except (OSError, ValueError, RecursionError, AttributeError, TypeError) as error:
        raise InputError(f"Expected train, val and test subjects in {path}: {error}.") from None
    lacks = [f"{name}.npz is not there" for name in _FILES if not (folder / f"{name}.npz").is_file()]
    lacks += [f"splits.json does not list {name}" for name in _FILES if name not in split]
    if lacks:
        raise InputError(
            f"Expected the {_EDITION} edition of the project's motion capture in {folder}, but {' and '.join(lacks)}; "
            "put that edition there, or set PCNET3D_DATA to the folder that has it."
        )
    return split


def _members(split: dict[str, dict[str, set[str]]], subjects: Subjects, path: Path) -> dict[str, set[str]]:
    """{file: its people among `subjects`}. InputError when there are none, or somebody is in two parts."""
    places: dict[str, list[str]] = {}
    for parts in split.values():
        for key, people in parts.items():
            for one in people:
                places.setdefault(one, []).append(key)
    if twice := [f"{one} ({' and '.join(where)})" for one, where in places.items() if len(where) > 1]:
        raise InputError(
            f"Expected every subject in one part of {path} only; not so: {', '.join(sorted(twice))}."
        )
    part = "test" if subjects == "tennis" else subjects.partition("-")[0]
    members = {
        name: parts[part]
        for name, parts in split.items()
        if part != "test" or (name == _TENNIS) == (subjects == "tennis")
    }
    if not any(members.values()):
        raise InputError(f"Expected {subjects} subjects in {path}, but it lists none.")
    return members


def lying(joints_world: np.ndarray) -> np.ndarray:
    """(...,) True where the trunk is more than 60 degrees from vertical; joints (..., 17, 3), +Z up.

    The trunk is mid-hips to mid-shoulders. Bending far forward counts as lying too: what matters here is that the
    trunk no longer tells which way is up.
    """
    return trunk_lean_deg(joints_world) > LYING_DEG
