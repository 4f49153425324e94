"""JSON of people in 2D, whoever wrote it: detections in a flat list, frames with a list of people each, or people by
image; and a person's keypoints in the spellings in use."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from .clock import Moments
from .json import beginning, each, numbers

_PEOPLE = (
    "instances",
    "detections",
    "people",
    "persons",
    "predictions",
    "poses",
    "objects",
    "bodies",
    "annotations",
)
_KEYPOINTS = ("keypoints", "pose_keypoints_2d", "pose_keypoints", "joints", "keypoints_2d", "kpts")
_SCORES = ("keypoint_scores", "keypoints_scores", "keypoints_score", "keypoints_conf", "scores", "kpt_scores")
_SCORE = ("score", "visible", "conf", "confidence", "visibility", "c", "v")  # of one point


def first_person(path: Path) -> tuple[Mapping[str, Any], bool] | None:
    """The first person in the beginning of such a file, and whether a list of detections has them, not a frame; None
    for anything else. Never raises."""
    content = beginning(path)
    if isinstance(content, dict):
        content = next((value for value in content.values() if isinstance(value, list)), [*content.values()])
    for entry in content if isinstance(content, list) else ():
        people = people_of(entry)
        if people is None or not all(isinstance(person, dict) for person in people):
            return None
        if people:
            return people[0], people[0] is entry
    return None


def people_of(entry: Any) -> list[Any] | None:
    """Everybody of one entry: of a frame the people, of a detection itself; None for anything else."""
    if isinstance(entry, str) and entry[:1] in ("[", "{"):  # JSON in JSON, as who dumps what was JSON already
        try:
            entry = json.loads(entry)
        except (ValueError, RecursionError):
            return None
    if isinstance(entry, list):
        return entry
    if not isinstance(entry, dict):
        return None
    if any(key in entry for key in _KEYPOINTS):
        return [entry]
    listed = next((entry[key] for key in _PEOPLE if key in entry), ())
    return [] if listed is None else listed if isinstance(listed, list) else None


def people(path: Path, what: str, moments: Moments) -> Iterator[tuple[int, Any, str]]:
    """Moment, person and place of everybody in the file; frames without anybody count. what: the file in words.

    InputError when the file cannot be read, and for an entry that holds no people.
    """
    listed = None
    for i, (key, entry) in enumerate(each(path, what)):
        where = f"{path}, entry {i}"
        found = people_of(entry)
        if found is None or (not found and not isinstance(entry, list) and key not in ("", listed)):
            if key not in ("", listed):
                moments.state(key, entry)  # what an object tells beside its list
                continue
            raise InputError(
                "wrong-content",
                f"{where}: expected an object with '{_KEYPOINTS[0]}', or a frame with people.",
            )
        listed = key
        image = {"frame_name": key} if re.search(r"[\d.]", key) else {}  # an object of images by their names
        moment = moments.of((entry if isinstance(entry, dict) else {}) | image, where)
        if moment is not None:
            yield from ((moment, person, where) for person in found)
    if listed is None:
        raise InputError("format-unknown", f"{path}: expected a list of people or of frames, got none.")


def points_of(person: Any, where: str) -> np.ndarray:
    """(J, 3) x, y and score of a person's joints, NaN where missing, and where there are no scores. InputError for a
    person without keypoints, and for those of another form."""
    key = next((key for key in _KEYPOINTS if key in person), None) if isinstance(person, dict) else None
    if key is None:
        raise InputError(
            "wrong-content", f"{where}: expected an object with '{_KEYPOINTS[0]}', got {person!r:.80}."
        )
    held = person[key]
    if isinstance(held, dict):  # Ultralytics
        score = next((held[name] for name in _SCORE if name in held), None)
        held = [held.get("x"), held.get("y"), *([] if score is None else [score])]
        values = numbers(held, where).T
    elif isinstance(held, list) and held and isinstance(held[0], dict):  # TF.js
        values = numbers([[point.get("x"), point.get("y"), _first(point, _SCORE)] for point in held], where)
    else:
        values = numbers(held, where)
        if values.ndim == 1 and len(values) and not len(values) % 3:
            values = values.reshape(-1, 3)
    scores = _first(person, _SCORES)
    if isinstance(scores, list):
        values = _with_scores(values, numbers(scores, where), where)
    if values.ndim == 2 and values.shape[1] == 2:
        values = np.column_stack([values, np.full(len(values), np.nan)])
    if values.ndim != 2 or values.shape[1] != 3 or not len(values):
        raise InputError(
            "wrong-content",
            f"{where}: expected x, y and score of each joint, got keypoints of shape {values.shape}.",
        )
    return values.astype(np.float32)


def _with_scores(values: np.ndarray, scores: np.ndarray, where: str) -> np.ndarray:
    if values.ndim == 2 and values.shape[1] == 3:
        raise InputError(
            "format-unknown",
            f"{where}: expected 2D keypoints, got three coordinates each beside their scores; this is a 3D output: give "
            "it with --poses.",
        )
    if values.shape != (*scores.shape, 2):
        raise InputError(
            "wrong-content",
            f"{where}: expected x, y and one score of each joint, got keypoints of shape {values.shape} and scores of "
            f"shape {scores.shape}.",
        )
    return np.column_stack([values, scores])


def _first(held: Mapping[str, Any], keys: tuple[str, ...]) -> Any:
    return next((held[key] for key in keys if key in held), None)
