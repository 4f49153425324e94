"""The runs of several people of one recording: a folder each, and the index over them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.pose import package_version
from ..core.system import is_file_name
from ..core.take import Take
from ..files.atomic import SUMMARY, write_json

_LONGEST = 60  # characters of a folder's name


@dataclass(frozen=True, eq=False)
class PersonRun:
    """person, frames: name in the file, and rows there, or in the part of it that is asked for. folder: name of their
    run's folder, and take: what it holds; or code and reason of the refusal (InputError): why there is none."""

    person: str
    frames: int
    folder: str = ""
    take: Take | None = None
    code: str = ""
    reason: str = ""


def folder_names(people: Sequence[str]) -> list[str]:
    """A name for each person's folder that every file system takes, different from all others in any case."""
    names: list[str] = []
    for person in people:
        safe = re.sub(r"[^A-Za-z0-9_-]+", "_", person)[:_LONGEST] or "_"
        safe = safe if is_file_name(safe) else f"{safe}_"
        name, number = safe, 2
        while name.lower() in (taken.lower() for taken in names):
            name, number = f"{safe}_{number}", number + 1
        names.append(name)
    return names


def write_index(runs: Sequence[PersonRun], folder: Path) -> None:
    """summary.json of the folder that holds the runs: who is in which folder, and who was left out and why."""
    content = {
        "pcnet3d": package_version(),
        "people": [_entry(run, run.take) for run in runs if run.take is not None],
        "left_out": [
            {"person": run.person, "frames": run.frames, "code": run.code, "reason": run.reason}
            for run in runs
            if run.take is None
        ],
    }
    write_json(folder / SUMMARY, content)


def _entry(run: PersonRun, take: Take) -> dict[str, Any]:
    rows, level = take.rows, take.rectified
    assert rows is not None
    return {
        "person": run.person,
        "folder": run.folder,
        "frames": run.frames,
        "first_frame": int(rows.frame_index[0]),
        "last_frame": int(rows.frame_index[-1]),
        "level_ok": level is not None and level.level_ok,
        "warnings": sum(each.warns for each in take.said),
    }
