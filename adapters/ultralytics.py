"""The folder of texts that Ultralytics' save_txt fills (formats.md 5); its JSON is read by adapter json2d.

A folder holds `<video>_<frame>.txt`, frames from 1, a line a person: class, box (4), then x, y and score of each joint
of COCO-17, and maybe the track; shares of the image's width and height, so that the size has to be known. Joints hardly
seen are at 0, 0.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.opened import first_lines, whole_text
from .kit.json import numbered_files
from .kit.people import People, in_pixels

name = "ultralytics"
gives = "keypoints"
reads = "folder of Ultralytics' save_txt (needs the image's size), COCO-17"

_BEFORE = 5  # numbers: class and box
_JOINTS = len(COCO17)
_COUNTS = (_BEFORE + 2 * _JOINTS, _BEFORE + 3 * _JOINTS, _BEFORE + 3 * _JOINTS + 1)
_NUMBER = re.compile(r"(?:^|_)(\d+)$")


def sniff(path: Path) -> bool:
    first = next(iter(_files(path)), None) if path.is_dir() else None
    return first is not None and len((first_lines(first, 4096) or [""])[0].split()) in _COUNTS


def read(
    path: Path, track: bool = False, image_size: tuple[int, int] | None = None
) -> tuple[PoseSequence, ...]:
    """One sequence a person, named by the track, or joined from frame to frame by nearness in results without.

    track: ignore the tracks and join people by nearness all the same. image_size: width and height in pixels; a run
    takes those of its video, or of read.image_size. Raises InputError when the files are of another form.
    """
    sightings = People(str(path))
    for number, file in numbered_files(path, _files(path), "the texts of one video"):
        lines = whole_text(file, "people of one frame").splitlines()
        for line, text in enumerate(filter(str.strip, lines), 1):
            try:
                values = np.array(text.split(), dtype=np.float64)
            except ValueError:
                values = np.zeros(0)
            if len(values) not in _COUNTS or not np.isfinite(values).all():
                raise InputError(
                    "wrong-content",
                    f"{file}, line {line}: expected class, box and x, y (and score) of {_JOINTS} joints, got "
                    f"{text!r:.60}.",
                )
            columns = 2 if len(values) == _COUNTS[0] else 3
            points = values[_BEFORE : _BEFORE + columns * _JOINTS].reshape(_JOINTS, columns)
            scores = points[:, 2] if columns == 3 else None
            person = None if track or len(values) < _COUNTS[2] else f"{values[-1]:.0f}"
            sightings.add(number - 1, in_pixels(points[:, :2], image_size, str(path)), scores, person)
    return sightings.keypoints()


def _files(path: Path) -> list[Path]:
    return sorted(file for file in path.glob("*.txt") if _NUMBER.search(file.stem))
