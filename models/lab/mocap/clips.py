"""Motion capture as training and test material: clips of world joints, their subjects, and who is trained on and who is
held out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import numpy as np
from pydantic import BaseModel

from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import angle_deg
from ....pipeline.reading.mocap import Clip, read_mocap
from ..common.toml_config import read_json

Subjects = Literal["train", "val", "test", "hdm05", "tennis"]
OWN_SKELETON = ("asfamc", "max", "markers", "accad-bvh", "arena")  # sources with the people's own proportions

LYING_DEG = 60.0  # from the vertical, beyond which a trunk no longer tells which way is up

_TENNIS = "tennis_mocap"
PARTS = ("train", "val", "test")


class Listed(BaseModel):
    """Who is in which part: people, or with by "clip" names of clips."""

    train: set[str] = set()
    val: set[str] = set()
    test: set[str] = set()
    by: Literal["subject", "clip"] = "subject"


class _Splits(BaseModel):
    """splits.json, by the files of motion capture."""

    cmu_mocap: Listed
    accad_mocap: Listed
    tennis_mocap: Listed


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

    "train" and "val" are those of every file that splits.json lists (CMU, ACCAD, tennis); "test" is CMU's; "hdm05" is
    all of HDM05 and "tennis" the test players of tennis, test sets of their own of other people and movements, other
    laboratories and body models. InputError for another name, or where the data is not.
    """
    if subjects not in get_args(Subjects):
        raise InputError(
            "bad-value", f"Expected subjects of {', '.join(get_args(Subjects))}; got '{subjects}'."
        )
    folder = folder or data_folder()
    if subjects == "hdm05":
        return read_mocap(folder / "hdm05_subset.npz")
    members = _members(folder / "splits.json", subjects)
    files = [folder / f"{name}.npz" for name, people in members.items() if people]
    clips = tuple(
        clip for path in files for clip in read_mocap(path) if subject_of(clip.name) in members[path.stem]
    )
    if not clips:
        raise InputError(
            "nothing-usable",
            f"Expected clips of {subjects} subjects in {', '.join(map(str, files)) or folder}, but there are none of "
            "those that splits.json lists.",
        )
    return clips


def _members(path: Path, subjects: Subjects) -> dict[str, set[str]]:
    """{file: its people among `subjects`} by splits.json. InputError when it is no split, lists none of them, or has
    somebody in two parts."""
    listed = read_json(path, _Splits, "train, val and test subjects in JSON")
    split = {name: {part: getattr(of, part) for part in PARTS} for name, of in listed}
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
    part = "test" if subjects == "tennis" else subjects
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


def trunk_lean_deg(joints: np.ndarray) -> np.ndarray:
    """(...,) the angle in degrees between the trunk, mid-hips to mid-shoulders, of joints (..., 17, 3) and +z; NaN
    where one of the four is missing."""
    hips, shoulders = (
        joints[..., H36M17.indices((f"l_{part}", f"r_{part}")), :].mean(axis=-2)
        for part in ("hip", "shoulder")
    )
    trunk = (shoulders - hips).astype(np.float64)
    return np.asarray(angle_deg(trunk, np.broadcast_to((0.0, 0.0, 1.0), trunk.shape)))


class Parts(NamedTuple):
    """The clips of each part ("train", "val", "test"), and what the split lists: "subject", or "clip" where the same
    people may be in several parts."""

    clips: dict[str, tuple[Clip, ...]]
    by: Literal["subject", "clip"]


def read_parts(data: Path, split: Path, needed: Sequence[str] = PARTS) -> Parts:
    """A file of clips (clips.read_mocap) by a JSON file of subjects: {"train": [...], "val": [...], "test": [...]}.

    A clip's subject is its name up to the first "_". With "by": "clip" the lists hold clip names. InputError when a
    needed part is missing or empty, a name is in two parts, or the data has no such subject or clip.
    """
    clips, listed = read_mocap(data), read_json(split, Listed, "train, val and test subjects in JSON")
    lists, by = {part: getattr(listed, part) for part in PARTS}, listed.by
    if missing := [part for part in needed if not lists[part]]:
        raise InputError(
            "nothing-usable",
            f"Expected {by}s for {', '.join(needed)} in {split}; {', '.join(missing)} has none.",
        )
    for part, other in combinations(PARTS, 2):
        if shared := lists[part] & lists[other]:
            raise InputError(
                "wrong-content",
                f"Expected every {by} in one part of {split} only, but {', '.join(sorted(shared))} is in {part} "
                f"and {other}.",
            )
    key = {clip.name: clip.name if by == "clip" else subject_of(clip.name) for clip in clips}
    if unknown := sorted(set().union(*lists.values()) - set(key.values())):
        raise InputError(
            "name-unknown", f"{split} lists {by}s that {data} does not have: {', '.join(unknown[:10])}."
        )
    return Parts({part: tuple(c for c in clips if key[c.name] in names) for part, names in lists.items()}, by)
