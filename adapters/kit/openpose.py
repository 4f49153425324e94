"""The folder that OpenPose's --write_json fills: one `<video>_<number>_keypoints.json` a frame (formats.md 6).

Tools that follow OpenPose name the files otherwise (Pose2Sim: cam01.0000.json), so without files of OpenPose's own
names those are taken whose names hold a number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from .json import entries, field, frame_number, load

_ENDING = "_keypoints.json"
_NUMBER = re.compile(r"([0-9]+)")


def frame_files(path: Path) -> list[Path]:
    """The frames' files, sorted by name; none for anything but a folder of such files."""
    files = sorted(file for file in path.glob("*.json") if not file.name.startswith("."))
    return [file for file in files if file.name.endswith(_ENDING)] or [
        file for file in files if _NUMBER.search(file.stem)
    ]


def people(path: Path) -> Iterator[tuple[int, Any, str]]:
    """(frame, person, where) of everybody; frame = number in the file's name, where = the file, for errors.

    Raises InputError when the folder holds no such files, those of several videos or one without a number, and when a
    file is not OpenPose's.
    """
    for frame, file in _frames(path):
        where = str(file)
        listed = field(load(file, "OpenPose's people of one frame"), "people", where)
        for person in entries(listed, where):
            yield frame, person, where


def _frames(path: Path) -> list[tuple[int, Path]]:
    """Frame and file in order of names: the last number in a name that is not the same in all of them counts.
    InputError for a file without it."""
    files = frame_files(path)
    if not files:
        raise InputError(
            "format-unknown",
            f"Expected a folder of OpenPose's *{_ENDING} files, or of others numbered by frame (cam01.0000.json), at "
            f"{path}, found none there.",
        )
    names = [_NUMBER.split(file.name.removesuffix(".json").removesuffix("_keypoints")) for file in files]
    places = range(2, max(map(len, names)) + 1, 2)  # of the numbers, from the end
    place = next((p for p in places if len({name[-p] for name in names if len(name) > p}) > 1), 2)
    short = next((file for file, name in zip(files, names, strict=True) if len(name) <= place), None)
    if short is not None:
        raise InputError(
            "wrong-content",
            f"Expected a frame's number in the name of each file in {path}, in the same place, got {short.name}; take "
            "it out of the folder, or number it.",
        )
    videos = sorted({"".join((*name[:-place], "*", *name[len(name) - place + 1 :])) for name in names})
    if len(videos) > 1:
        raise InputError(
            "files-apart",
            f"Expected the frames of one video in {path}, got those of {len(videos)}: {videos[0]}, {videos[1]}; "
            "give each video a folder of its own.",
        )
    return [(frame_number(name[-place], str(file)), file) for name, file in zip(names, files, strict=True)]
