"""The folder that OpenPose's --write_json fills: one `<video>_<number>_keypoints.json` a frame (formats.md 6)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..pipeline.errors import InputError
from ._json import entries, field, frame_number, load

_ENDING = "_keypoints.json"
_DIGITS = "0123456789"


def frame_files(path: Path) -> Iterator[Path]:
    return (file for file in path.glob(f"*{_ENDING}") if not file.name.startswith("."))


def people(path: Path) -> Iterator[tuple[int, Any, str]]:
    """(frame, person, where) of everybody; frame = number in the file's name, where = the file, for errors.

    Raises InputError when the folder holds no such files or those of several videos, and when a file is not OpenPose's.
    """
    files = sorted(frame_files(path))
    if not files:
        raise InputError(f"Expected a folder of OpenPose's *{_ENDING} files at {path}, found none there.")
    videos = sorted({file.name.removesuffix(_ENDING).rstrip(_DIGITS) for file in files})
    if len(videos) > 1:
        raise InputError(
            f"Expected the frames of one video in {path}, got those of {len(videos)}: {videos[0]}*, {videos[1]}*; "
            "give each video a folder of its own."
        )
    for file in files:
        frame, where = frame_number(file.name.removesuffix(_ENDING), str(file)), str(file)
        listed = field(load(file, "OpenPose's people of one frame"), "people", where)
        for person in entries(listed, where):
            yield frame, person, where
