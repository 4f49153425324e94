"""Motion capture as training and test material: the file of clips that `pcnet3d lab data` writes, their subjects, and
who is trained on and who is held out."""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ValidationError

from ...pipeline.core.errors import InputError, readable
from ...pipeline.core.layouts import H36M17
from ...pipeline.core.rotations import angle_deg
from ...pipeline.files.arrays import load_all

Subjects = Literal["train", "val", "test", "hdm05", "tennis"]
OWN_SKELETON = ("asfamc", "max", "markers", "accad-bvh", "arena")  # sources with the people's own proportions

FPS = 30.0  # of all clips in files
LYING_DEG = 60.0  # from the vertical, beyond which a trunk no longer tells which way is up
PARTS = ("train", "val", "test")


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
    arrays = read_rows(
        path,
        "clips of motion capture of H36M17, as `pcnet3d lab data` writes them",
        "clip_start",
        joints=(("frames", len(H36M17), 3), "f"),
        root=(("frames", 3), "f"),
        fps=((), "fiu"),
        joint_names=((len(H36M17),), "U"),
        **dict.fromkeys(("clip_name", "subject", "source"), (("clips",), "U")),
    )
    if tuple(arrays["joint_names"]) != H36M17.joints or arrays["fps"] != FPS:
        raise InputError(
            "wrong-content",
            f"Expected joints of H36M17, {FPS:g} times a second, in {path}: see joint_names, fps.",
        )
    world = (arrays["joints"] + arrays["root"][:, None]).astype(np.float32)
    if not np.isfinite(world).all():
        raise InputError(
            "file-damaged",
            f"Expected finite joints in {path}, got NaN or infinite ones; the file is damaged.",
        )
    names, subjects, sources = (arrays[of].tolist() for of in ("clip_name", "subject", "source"))
    parts = np.split(world, arrays["clip_start"][1:-1])
    return tuple(
        Clip(name, subject, source, FPS, joints)
        for name, subject, source, joints in zip(names, subjects, sources, parts, strict=True)
    )


def read_rows(
    path: Path, what: str, starts: str, **wanted: tuple[tuple[int | str, ...], str]
) -> dict[str, np.ndarray]:
    """Arrays (T, ...) of an .npz file whose frames belong to one clip after another. starts: the array (C + 1,) of
    where each clip's frames begin and the last one's end. wanted: of the others shape, in which "frames" and "clips"
    are as many as `starts` says, and numpy's kinds. InputError for another file; what: in words, what it should
    hold."""
    arrays = load_all(path, starts, *wanted)
    start = arrays[starts]
    goes_up = start.ndim == 1 and start.dtype.kind in "iu" and len(start) > 1 and start[0] == 0
    if goes_up and (np.diff(start.astype(float)) > 0).all():
        count: dict[int | str, int] = {"frames": int(start[-1]), "clips": len(start) - 1}
        wrong = [
            name
            for name, (shape, kinds) in wanted.items()
            if arrays[name].shape != tuple(count.get(n, n) for n in shape)
            or arrays[name].dtype.kind not in kinds
        ]
    else:
        wrong = [starts]
    if wrong:
        raise InputError("wrong-content", f"Expected {what} in {path}, got others: see {', '.join(wrong)}.")
    return arrays


class _Splits(BaseModel):
    """splits.json: people of each part, by the files of motion capture; `clips` are recordings of one's own."""

    cmu_mocap: dict[str, set[str]] = {}
    accad_mocap: dict[str, set[str]] = {}
    tennis_mocap: dict[str, set[str]] = {}
    clips: dict[str, set[str]] = {}


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
    named = os.environ.get("PCNET3D_DATA", "")
    if not named or not (Path(named) / "splits.json").is_file():
        raise InputError(
            "cannot-open" if named else "needs-input",
            f"Expected motion capture{f' in {named}' * bool(named)}; set PCNET3D_DATA to a folder with splits.json.",
        )
    return Path(named)


def read_clips(subjects: Subjects, folder: Path | None = None) -> tuple[Clip, ...]:
    """The clips of one part of a data folder, split by subject.

    "train" and "val" are those of every file that splits.json lists (CMU, ACCAD, tennis, one's own); "test" is theirs
    but tennis's; "hdm05" is all of HDM05 and "tennis" the test players of tennis, test sets of their own of other
    people and movements, other laboratories and body models. InputError where the data is not.
    """
    folder = folder or data_folder()
    if subjects == "hdm05":
        return read_mocap(folder / "hdm05_subset.npz")
    path = folder / "splits.json"
    try:
        with readable(path, "train, val and test subjects in JSON"):
            splits = dict(_Splits.model_validate_json(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        raise InputError("bad-value", f"{path}: {error.errors()[0]['msg']}.") from None
    people = {part: set().union(*(of.get(part, ()) for of in splits.values())) for part in PARTS}
    for part, other in combinations(PARTS, 2):
        if shared := people[part] & people[other]:
            raise InputError(
                "wrong-content",
                f"Expected every subject in one part of {path} only, but {', '.join(sorted(shared))} is in {part} "
                f"and {other}.",
            )
    part = "test" if subjects == "tennis" else subjects
    clips: list[Clip] = []
    for name, listed in splits.items():
        asked = listed.get(part)
        if asked and (part != "test" or (name == "tennis_mocap") == (subjects == "tennis")):
            clips += [clip for clip in read_mocap(folder / f"{name}.npz") if subject_of(clip.name) in asked]
    if not clips:
        raise InputError(
            "nothing-usable",
            f"Expected clips of {subjects} subjects in {folder}, but there are none of those that splits.json lists.",
        )
    return tuple(clips)


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
