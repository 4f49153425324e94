"""A data folder, as PCNET3D_DATA names it, out of motion capture that anybody may download:

pcnet3d lab data --cmu allasfamc --accad BVH --hdm05 HDM05 -o data

The people of each part are those of splits.json beside this module, as the shipped networks know them.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from typer import Option

from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many
from ....pipeline.files.atomic import refuse_unwritable, write_json
from ....pipeline.files.digest import sha256
from .clips import Clip, read_mocap, subject_of
from .convert import read_folder, write_mocap

# The people of each part, by file.
SPLITS: dict[str, dict[str, list[str]]] = json.loads(
    Path(__file__).with_name("splits.json").read_text(encoding="utf-8")
)
_MADE = "data.json"  # digests of what was made
# Acclaim's "radius" ends 19 cm from the elbow; the wrist markers of CMU's 01_01 are 29 away, and people's wrists 27.
_FOREARM = 1.38
# Arena's upper arm is 65 to 90 % of a real one, which is 1.05 forearms long (de Leva 1996).
_UPPER_ARM = 1.05


def with_whole_forearms(clip: Clip) -> Clip:
    """The wrists of an Acclaim skeleton, where people have them."""
    joints = clip.joints.copy()
    for side in "lr":
        elbow, wrist = H36M17.indices((f"{side}_elbow", f"{side}_wrist"))
        joints[:, wrist] = joints[:, elbow] + _FOREARM * (joints[:, wrist] - joints[:, elbow])
    return replace(clip, joints=joints)


def of_accad(clip: Clip) -> Clip:
    """As splits.json calls the person: m1 is Male1."""
    person, stroke = f"accad-{clip.subject[0]}{clip.subject[-1]}".lower(), clip.name.partition("_")[2]
    name = f"{person}_bvh-{stroke.lower().replace('_', '-')}"
    return replace(clip, name=name, subject=person, source="accad-bvh")


def of_tennis(clip: Clip) -> Clip:
    """As splits.json calls the player, with the upper arms of people, the forearms moved along."""
    joints = clip.joints.copy()
    for side in "lr":
        shoulder, elbow, wrist = H36M17.indices([f"{side}_{part}" for part in ("shoulder", "elbow", "wrist")])
        upper, forearm = (
            clip.joints[:, b] - clip.joints[:, a] for a, b in ((shoulder, elbow), (elbow, wrist))
        )
        share = _UPPER_ARM * (forearm**2).sum(-1).mean() ** 0.5 / (upper**2).sum(-1).mean() ** 0.5
        joints[:, elbow] = joints[:, shoulder] + share * upper
        joints[:, wrist] = joints[:, elbow] + forearm
    person = f"tennis-{clip.subject.lower()}"
    name = f"{person}_{clip.name.partition('_')[2]}"
    return replace(clip, name=name, subject=person, source="arena", joints=joints)


@dataclass(frozen=True)
class Source:
    """file: in the data folder, without an ending. name, what, address, licence: in words, for who has to fetch it.
    made: what is changed in a clip as it was read."""

    file: str
    name: str
    what: str
    address: str
    licence: str
    made: Callable[[Clip], Clip]

    @property
    def way(self) -> str:
        return f"{self.name} ({self.licence}): download {self.what} from {self.address}, unpack it"


SOURCES = {
    "cmu": Source(
        "cmu_mocap", "CMU's motion capture", "all ASF/AMC files", "mocap.cs.cmu.edu",
        "free for all uses, the data itself not to be resold", with_whole_forearms,
    ),
    "accad": Source(
        "accad_mocap", "ACCAD's Open Motion Project", "the BVH files of Male1, Male2 and Female1",
        "accad.osu.edu (Motion Lab)", "CC BY 3.0", of_accad,
    ),
    "tennis": Source(
        "tennis_mocap", "Tennis-MoCap", "a folder of BVH files for each player",
        "the authors of LNCS 10125, pp. 309-317", "CC BY-SA 3.0", of_tennis,
    ),
    "hdm05": Source(
        "hdm05_subset", "HDM05", "the cut AMC files with their ASF skeletons", "resources.mpi-inf.mpg.de/HDM05",
        "CC BY-SA 3.0", with_whole_forearms,
    ),
}  # fmt: skip


def data(
    output: Annotated[Path, Option("-o", "--output", help="The data folder.")],
    cmu: Annotated[Path | None, Option(help="Folder of CMU's ASF/AMC files.")] = None,
    accad: Annotated[Path | None, Option(help="Folder of ACCAD's BVH files.")] = None,
    tennis: Annotated[Path | None, Option(help="Folder of Tennis-MoCap's BVH files.")] = None,
    hdm05: Annotated[Path | None, Option(help="Folder of HDM05's ASF/AMC files.")] = None,
) -> None:
    """Make a data folder for training and evaluation from free motion capture that was downloaded.

    A folder that already has a file of the data folder gives that file. What is there is not made again. Without a
    folder it says what to download from where.
    """
    folders = {"cmu": cmu, "accad": accad, "tennis": tennis, "hdm05": hdm05}
    given = {name: folder for name, folder in folders.items() if folder is not None}
    if not given:
        ways = "; ".join(
            f"{source.way}, and give its folder with --{name}" for name, source in SOURCES.items()
        )
        raise InputError("needs-input", f"Expected a folder of motion capture. {ways}.")
    refuse_unwritable(output)
    output.mkdir(parents=True, exist_ok=True)
    for name, folder in given.items():
        source = SOURCES[name]
        clips = made(source, folder, output)
        people, minutes = len({subject_of(clip.name) for clip in clips}), sum(map(len, clips)) / 1800
        print(
            f"{output / source.file}.npz: {how_many(len(clips), 'clip')} of {how_many(people, 'person', 'people')}, "
            f"{minutes:.1f} min; credit: {source.licence}"
        )
    write_json(output / "splits.json", splits_of(output))
    print(f"{output / 'splits.json'}: for training and evaluation set PCNET3D_DATA={output}")


def made(source: Source, folder: Path, output: Path) -> tuple[Clip, ...]:
    """The clips of a source's file, which is written unless it is there. InputError for a folder without recordings,
    and for a file that is not as it was made."""
    path, listing = output / f"{source.file}.npz", output / _MADE
    digests = json.loads(listing.read_text(encoding="utf-8")) if listing.exists() else {}
    if not path.exists():
        ready = folder / path.name
        write_mocap(path, read_mocap(ready) if ready.exists() else converted(source, folder))
        write_json(listing, {**digests, source.file: sha256(path)})
    elif digests.get(source.file) != sha256(path):
        raise InputError(
            "file-damaged",
            f"Expected {path} as this command made it, but its digest is another one; remove it to make it anew.",
        )
    return read_mocap(path)


def converted(source: Source, folder: Path) -> list[Clip]:
    """The recordings of a folder as the data folder has them, of people who are in a part. InputError for a folder that
    is not there, and where nothing can be read."""
    if not folder.is_dir():
        raise InputError("cannot-open", f"Expected a folder at {folder}. {source.way}.")
    people = {person for of_part in SPLITS.get(source.file, {}).values() for person in of_part}
    # Of CMU's thousands of files only theirs are read.
    cmu = source is SOURCES["cmu"]
    clips = read_folder(folder, only=lambda file: not cmu or subject_of(file.stem) in people)
    kept = [clip for clip in map(source.made, clips) if not people or subject_of(clip.name) in people]
    if not kept:
        raise InputError("nothing-usable", f"Expected recordings of {', '.join(sorted(people))} in {folder}.")
    return kept


def splits_of(output: Path) -> dict[str, dict[str, list[str]]]:
    """What splits.json of the folder says: of every file the people of each part whom it has."""
    splits = {}
    for file, parts in SPLITS.items():
        path = output / f"{file}.npz"
        there = {subject_of(clip.name) for clip in read_mocap(path)} if path.exists() else set()
        splits[file] = {part: [who for who in people if who in there] for part, people in parts.items()}
    return splits
