"""A data folder, as PCNET3D_DATA names it, out of motion capture that anybody may download:

pcnet3d lab data --cmu allasfamc --hdm05 HDM05 -o data

The people of each part are those of splits.json beside this module, as the shipped networks know them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.messages import how_many, say
from ....pipeline.files.atomic import refuse_unwritable, write_json
from ....pipeline.files.digest import sha256
from ....pipeline.reading.mocap import Clip, read_mocap
from .clips import PARTS, subject_of
from .convert import read_folder
from .files import write_mocap

SPLITS = Path(__file__).with_name("splits.json")
_MADE = "data.json"  # digests of what was made
# Acclaim's "radius" ends 19 cm from the elbow; the wrist markers of CMU's 01_01 are 29 away, and people's wrists 27.
_FOREARM = 1.38


@dataclass(frozen=True)
class Source:
    """file: in the data folder, without an ending. name, what, address, licence: in words, for who has to fetch it."""

    file: str
    name: str
    what: str
    address: str
    licence: str

    @property
    def way(self) -> str:
        return f"{self.name} ({self.licence}): download {self.what} from {self.address}, unpack it"


CMU = Source(
    "cmu_mocap", "CMU's motion capture", "all ASF/AMC files", "mocap.cs.cmu.edu",
    "free for all uses, the data itself not to be resold",
)  # fmt: skip
HDM05 = Source(
    "hdm05_subset", "HDM05", "the cut AMC files with their ASF skeletons", "resources.mpi-inf.mpg.de/HDM05",
    "CC BY-SA 3.0",
)  # fmt: skip


def data(
    output: Annotated[Path, typer.Option("-o", "--output", help="The data folder.")],
    cmu: Annotated[
        Path | None, typer.Option(help="Folder of CMU's ASF/AMC files, from mocap.cs.cmu.edu.")
    ] = None,
    hdm05: Annotated[
        Path | None,
        typer.Option(help="Folder of HDM05's ASF/AMC files, from resources.mpi-inf.mpg.de/HDM05."),
    ] = None,
) -> None:
    """Make a data folder for training and evaluation from free motion capture that was downloaded.

    A folder that already has cmu_mocap.npz or hdm05_subset.npz gives that file. What is there is not made again.
    """
    given = {source: folder for source, folder in ((CMU, cmu), (HDM05, hdm05)) if folder is not None}
    if not given:
        ways = "; ".join(f"{source.way}, and give its folder" for source in (CMU, HDM05))
        raise InputError("needs-input", f"Expected --cmu FOLDER or --hdm05 FOLDER. {ways}.")
    refuse_unwritable(output)
    output.mkdir(parents=True, exist_ok=True)
    for source, folder in given.items():
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
    if path.exists():
        if digests.get(source.file) != sha256(path):
            raise InputError(
                "file-damaged",
                f"Expected {path} as this command made it, but its digest is another one; remove it to make it anew.",
            )
        return read_mocap(path)
    ready = folder / path.name
    write_mocap(path, list(read_mocap(ready)) if ready.exists() else converted(source, folder))
    write_json(listing, {**digests, source.file: sha256(path)})
    return read_mocap(path)


def converted(source: Source, folder: Path) -> list[Clip]:
    """The recordings of a folder, with whole forearms; of CMU those of people who are in a part. InputError for a
    folder that is not there, and where nothing can be read."""
    if not folder.is_dir():
        raise InputError("cannot-open", f"Expected a folder at {folder}. {source.way}.")
    listed = json.loads(SPLITS.read_text(encoding="utf-8")).get(source.file, {})
    people = {person for part in PARTS for person in listed.get(part, ())}
    clips, notes = read_folder(
        folder, "asfamc", only=lambda file: not people or subject_of(file.stem) in people
    )
    for note in notes:
        say("note", note)
    return [with_whole_forearms(clip) for clip in clips]


def with_whole_forearms(clip: Clip) -> Clip:
    """The wrists of an Acclaim skeleton, where people have them."""
    joints = clip.joints.copy()
    for side in "lr":
        elbow, wrist = H36M17.indices((f"{side}_elbow", f"{side}_wrist"))
        joints[:, wrist] = joints[:, elbow] + _FOREARM * (joints[:, wrist] - joints[:, elbow])
    return replace(clip, joints=joints)


def splits_of(output: Path) -> dict[str, dict[str, Sequence[str]]]:
    """What splits.json of the folder says: of every file the people of each part whom it has."""
    listed = json.loads(SPLITS.read_text(encoding="utf-8"))
    there: dict[str, set[str]] = {}
    for file in listed:
        path = output / f"{file}.npz"
        there[file] = {subject_of(clip.name) for clip in read_mocap(path)} if path.exists() else set()
    return {
        file: {part: [person for person in people if person in there[file]] for part, people in parts.items()}
        for file, parts in listed.items()
    }
