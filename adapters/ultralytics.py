"""Ultralytics' pose results: JSON of `Results.to_json`, or the folder of text files that `save_txt` fills (formats.md 6).

JSON is a list with the list of people of each frame, or of {frame, detections}: a person is {name, class, confidence,
box, track_id, keypoints: {x: [...], y: [...], visible: [...]}}, of COCO-17, in pixels. A folder holds `<video>_<frame>.txt`,
frames from 1, a line a person: class, box (4), then x, y and score of each joint, and maybe the track; shares of the
image's width and height, so that the size has to be known. Joints below the score that was asked for are at 0, 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.opened import filled_lines, first_lines
from .kit.people2d import first_person, people, points_of
from .kit.tracks import Detection, sequences

name = "ultralytics"
gives = "keypoints"
reads = "Ultralytics' pose results: JSON of to_json, or folder of save_txt (needs the image's size), COCO-17"

_BEFORE = 5  # numbers: class and box
_JOINTS = len(COCO17)
_COUNTS = (_BEFORE + 2 * _JOINTS, _BEFORE + 3 * _JOINTS, _BEFORE + 3 * _JOINTS + 1)
_NUMBER = re.compile(r"(?:^|_)(\d+)$")


def sniff(path: Path) -> bool:
    if path.is_dir():
        first = next(iter(_files(path)), None)
        return first is not None and len((first_lines(path / first, 4096) or [""])[0].split()) in _COUNTS
    found = first_person(path)
    points = found[0].get("keypoints") if found else None
    return isinstance(points, dict) and {"x", "y"} <= points.keys()


def read(
    path: Path, track: bool = False, image_size: tuple[int, int] | None = None
) -> tuple[PoseSequence, ...]:
    """One sequence a person, named by the track, or joined from frame to frame by nearness in results without.

    track: ignore the tracks and join people by nearness all the same. image_size: width and height in pixels, which a
    folder of text files needs; a run takes those of its video, or of read.image_size. Raises InputError when the files
    are of another form.
    """
    if path.is_dir():
        return sequences(_folder(path, track, image_size), str(path))
    moments = Moments(str(path))
    found = (
        Detection(moment, points_of(person, where), None if track else _track(person.get("track_id")))
        for moment, person, where in people(path, "Ultralytics' results", moments)
    )
    return sequences(found, str(path), clock=moments.clock)


def _track(track: object) -> str | None:
    return None if track is None else str(track)


def _files(path: Path) -> dict[str, int]:
    """The folder's text files by name, with the frame that each is of, counted from 0."""
    numbered = ((file.name, _NUMBER.search(file.stem)) for file in path.glob("*.txt"))
    found = {name: int(match[1]) - 1 for name, match in numbered if match}
    return dict(sorted(found.items(), key=lambda item: item[1]))


def _folder(path: Path, track: bool, image_size: tuple[int, int] | None) -> Iterator[Detection]:
    files = _files(path)
    videos = sorted({_NUMBER.sub("", Path(name).stem) for name in files})
    if len(videos) != 1:
        raise InputError(
            "files-apart" if videos else "format-unknown",
            f"Expected the numbered text files of one video in {path}, found those of {', '.join(videos[:3]) or 'none'}.",
        )
    if image_size is None:
        raise InputError(
            "needs-input",
            f"{path}: expected pixels, got shares of the image's width and height; give the video, or the image's size "
            "(--set read.image_size=1920x1080).",
        )
    for name, frame in files.items():
        for line, text in enumerate(filled_lines(path / name, "people of one frame"), 1):
            where = f"{path / name}, line {line}"
            try:
                values = np.array(text.split(), dtype=np.float64)
            except ValueError:
                values = np.zeros(0)
            if len(values) not in _COUNTS or not np.isfinite(values).all():
                raise InputError(
                    "wrong-content",
                    f"{where}: expected class, box and x, y (and score) of {_JOINTS} joints in numbers, got {text!r:.60}.",
                )
            scored = len(values) > _COUNTS[0]
            points = values[_BEFORE : _BEFORE + (2 + scored) * _JOINTS].reshape(_JOINTS, -1)
            points = points if scored else np.column_stack([points, np.full(_JOINTS, np.nan)])
            tracked = len(values) == _COUNTS[2] and not track
            yield Detection(frame, points * [*image_size, 1], f"{values[-1]:.0f}" if tracked else None)
