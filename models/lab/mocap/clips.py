"""Motion capture as training and test material: clips of world joints, their subjects and their split."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from ....pipeline.core.canonical import LYING_DEG, trunk_lean_deg
from ....pipeline.core.errors import InputError
from ....pipeline.reading.mocap.clip import Clip, read_mocap

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
        raise InputError(
            "needs-input", "Expected motion capture; set PCNET3D_DATA to the folder that has cmu_mocap.npz."
        )
    if not (Path(named) / "cmu_mocap.npz").is_file():
        raise InputError(
            "cannot-open", f"Expected cmu_mocap.npz in {named}; set PCNET3D_DATA to the folder that has it."
        )
    return Path(named)


def read_clips(subjects: Subjects, folder: Path | None = None) -> tuple[Clip, ...]:
    """The clips of one part of the project's own data, split by subject.

    "train" and "val" are those of every file that splits.json lists (CMU, ACCAD, tennis); "test" is CMU's; "train-a"
    and "train-b" are two disjoint halves of the train subjects; "hdm05" is all of HDM05 and "tennis" the test players
    of tennis, test sets of their own of other people and movements, other laboratories and body models. InputError for
    another name, or where the data is not, or is of an older edition.
    """
    if subjects not in get_args(Subjects):
        raise InputError(
            "bad-value", f"Expected subjects of {', '.join(get_args(Subjects))}; got '{subjects}'."
        )
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
            "nothing-usable",
            f"Expected clips of {subjects} subjects in {', '.join(map(str, files)) or folder}, but there are none of "
            "those that splits.json lists.",
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
        raise InputError(
            "file-damaged", f"Expected train, val and test subjects in {path}: {error}."
        ) from None
    lacks = [f"{name}.npz is not there" for name in _FILES if not (folder / f"{name}.npz").is_file()]
    lacks += [f"splits.json does not list {name}" for name in _FILES if name not in split]
    if lacks:
        raise InputError(
            "other-version",
            f"Expected the {_EDITION} edition of the project's motion capture in {folder}, but {' and '.join(lacks)}; "
            "put that edition there, or set PCNET3D_DATA to the folder that has it.",
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
            "wrong-content",
            f"Expected every subject in one part of {path} only; not so: {', '.join(sorted(twice))}.",
        )
    part = "test" if subjects == "tennis" else subjects.partition("-")[0]
    members = {
        name: parts[part]
        for name, parts in split.items()
        if part != "test" or (name == _TENNIS) == (subjects == "tennis")
    }
    if not any(members.values()):
        raise InputError("nothing-usable", f"Expected {subjects} subjects in {path}, but it lists none.")
    return members


def lying(joints_world: np.ndarray) -> np.ndarray:
    """(...,) True where the trunk is more than 60 degrees from vertical; joints (..., 17, 3), +Z up.

    The trunk is mid-hips to mid-shoulders. Bending far forward counts as lying too: what matters here is that the
    trunk no longer tells which way is up.
    """
    return trunk_lean_deg(joints_world) > LYING_DEG
