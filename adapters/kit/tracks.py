"""Detections, one person in one frame each, become one pose sequence a person."""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import IMAGE
from ...pipeline.core.layouts import (
    BLAZEPOSE33,
    BODY_25,
    BODY_25B,
    COCO17,
    COCO18,
    COCO23,
    HALPE26,
    MHR70,
    OPENPOSE18,
    Layout,
)
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.signals.joint_order import likely_layout
from ...pipeline.signals.tracker import REACH, Tracker, sighted, steps
from .clock import Clock

# The orders of joints in 2D, by their number; of one number the more usual first.
LAYOUTS = (COCO17, OPENPOSE18, COCO18, COCO23, BODY_25, BODY_25B, HALPE26, BLAZEPOSE33, MHR70)
_BODIES = {
    133: COCO23,
    136: HALPE26,
    94: HALPE26,
    68: HALPE26,
    135: BODY_25B,
}  # with face and hands: the first ones
_MOST_IN_FRAME, _MOST_NAMES = 500, 5_000  # more than detectors find in a crowd, or trackers name in a day
_WANDER = 0.05  # of the body's size a frame: how much further somebody may get unseen, running at 2.5 m/s and 30 fps
_PIECE = 10_000  # frames whose steps are looked at together
_SURE = 0.5  # of a joint's usual score


@dataclass(frozen=True, eq=False)
class Detection:
    """One person in one video frame.

    points: (J, 3) x and y in pixels and the detector's score (NaN without); 0, 0 or NaN is no joint.
    person: the detector's name of the person, None when it does not follow people from frame to frame.
    """

    frame: int
    points: np.ndarray
    person: str | None = None


def found_in(points: np.ndarray) -> np.ndarray:
    """(..., J) whether each joint of points (..., J, 3) is there: neither NaN nor at 0, 0, which detectors write for
    none, some of them with a score above 0 (Ultralytics' YOLO)."""
    places = points[..., :2]
    return ~np.isnan(places).any(axis=-1) & (places != 0).any(axis=-1)


class Crowd:
    """Who is in a file, counted while it is read, so that what is no recording of people is refused before it fills the
    memory or takes hours to be joined."""

    def __init__(self, where: str) -> None:
        self._where = where
        self._in_frame: Counter[int] = Counter()
        self._names: set[str] = set()

    def add(self, frame: int, person: str | None = None) -> None:
        """One more person. InputError from 500 in a frame, or 5,000 by name, on."""
        self._in_frame[frame] += 1
        if person is not None:
            self._names.add(person)
        if self._in_frame[frame] > _MOST_IN_FRAME or len(self._names) > _MOST_NAMES:
            many = (
                f"{_MOST_IN_FRAME} people in a frame"
                if len(self._names) <= _MOST_NAMES
                else f"{_MOST_NAMES} people"
            )
            raise InputError(
                "unsafe",
                f"{self._where}: expected at most {many}, got more by frame {frame}, where reading stopped; keep "
                "only the people that you need in the file, or raise the detector's threshold.",
            )


def counted(detections: Iterable[Detection], where: str) -> list[Detection]:
    """The detections in a list. InputError as soon as they are a `Crowd` too large."""
    crowd, kept = Crowd(where), []
    for detection in detections:
        crowd.add(detection.frame, detection.person)
        kept.append(detection)
    return kept


def sequences(
    detections: Iterable[Detection],
    where: str,
    layouts: Sequence[Layout] = LAYOUTS,
    clock: Callable[[], Clock] | None = None,
) -> tuple[PoseSequence, ...]:
    """One sequence a person in IMAGE, frames in order, people in the order in which they appear.

    layouts: those that the format can hold, told apart by their number of joints, and those of one number by their
    bones. clock: called once all detections are read; then their frames are moments of it.
    People without names are told apart by `_linked`; the history says so. Where some detections have a name, those
    without are left out, for trackers name nobody where they are not sure; the history warns with their number. It
    warns of a `leap` too, of somebody who is alone and of each whom a tracker names, for trackers exchange people. A
    joint that was not found is NaN with confidence NaN. Scores are taken for `confidences`.
    InputError for nobody at all, a `Crowd` too large, which is noticed while detections are read, another layout,
    coordinates that are no pixels, and a person who is in a frame twice.
    """
    detections = counted(detections, where)
    ticks = None if clock is None else clock()
    if ticks is not None:
        detections = [replace(one, frame=int(ticks.index[one.frame])) for one in detections]
    named = [detection for detection in detections if detection.person is not None]
    unnamed = len(detections) - len(named) if named else 0
    detections = sorted(named or detections, key=lambda one: one.frame)
    if not any(found_in(detection.points).any() for detection in detections):
        raise InputError("nothing-usable", f"{where}: no person was found in any frame.")
    likely = _layouts_of(detections, layouts, where)
    frames = np.array([detection.frame for detection in detections])
    points = np.stack([detection.points[: len(likely[0])] for detection in detections])
    there = found_in(points)
    points[~there] = np.nan
    layout = likely_layout(points[..., :2], likely)
    if np.abs(points[there][:, :2]).max() <= 1:
        raise InputError(
            "wrong-axes",
            f"{where}: expected pixels, got coordinates between -1 and 1; write them in pixels of the video "
            "(OpenPose: --keypoint_scale 0).",
        )
    unknown = saying_nothing(points[there][:, 2])
    said = [notice("scores-all-zero")] if unknown == "all are 0" else []
    people = _by_name(detections) if named else _linked(frames, points[..., :2])
    tracks = [
        _sequence(person, frames[rows], points[rows], layout, unknown, where)
        for person, rows in people.items()
    ]
    if ticks is not None:
        tracks = [ticks.on(poses) for poses in tracks]
    if named or len(tracks) == 1:
        tracks = [poses.saying(*_sure_leap(poses)) for poses in tracks]
    if not named:
        tracks = [poses.with_(linked=True).noted("link people", method="nearest") for poses in tracks]
    if unnamed:
        said.append(notice("no-track-number", unnamed=unnamed, detections=unnamed + len(named)))
        tracks = [poses.noted("track numbers", left_out=unnamed) for poses in tracks]
    return tuple(poses.saying(*said) for poses in tracks)


def _layouts_of(detections: Sequence[Detection], layouts: Sequence[Layout], where: str) -> Sequence[Layout]:
    """Those of the layouts that have as many joints as every detection, or as their body alone; InputError when there
    is none."""
    counts = {len(detection.points) for detection in detections}
    (count,) = counts if len(counts) == 1 else (0,)
    known = [layout for layout in layouts if len(layout) == count] or [
        layout for layout in layouts if layout is _BODIES.get(count)
    ]
    if known:
        return known
    numbers, more = (sorted({*map(len, layouts)}), [n for n, layout in _BODIES.items() if layout in layouts])
    with_hands = f", or with hands and face {', '.join(map(str, sorted(more)))}" * bool(more)
    got = ", ".join(map(str, sorted(counts)))
    raise InputError(
        "wrong-content",
        f"{where}: expected people of {', '.join(map(str, numbers))} joints{with_hands}, got {got}.",
    )


def once_a_frame(frames: np.ndarray, person: str, where: str, option: str) -> None:
    """InputError when somebody is in a frame twice. frames: (T,) in order; option: how to have people followed here."""
    twice = frames[1:][np.diff(frames) == 0]
    if len(twice):
        raise InputError(
            "people-mixed",
            f"{where}: expected each person once a frame, got person {person} more than once in frame {twice[0]}, so "
            "people are not tracked in this file; track them in the program that wrote it, or pass track=true "
            f"({option}), where its adapter has that, to join each one to the nearest of the frames before.",
        )


def confidences(scores: np.ndarray, unknown: str) -> tuple[np.ndarray, dict[str, Any]]:
    """Scores (T, J) as confidences, those outside [0, 1] clipped, NaN where they are `unknown` (`saying_nothing`); and
    what the history says of that."""
    if unknown:
        return np.full_like(scores, np.nan), {"unknown": unknown}
    outside = (scores < 0) | (scores > 1)
    said = {"clipped": int(outside.sum()), "highest": float(np.nanmax(scores))} if outside.any() else {}
    return np.clip(scores, 0, 1), said


def _sequence(
    person: str, frames: np.ndarray, points: np.ndarray, layout: Layout, unknown: str, where: str
) -> PoseSequence:
    """Of one person's frames (T,) and points (T, J, 3), NaN where not found."""
    once_a_frame(frames, person, where, "--set keypoints.track=true")
    confidence, said = confidences(points[..., 2], unknown)
    poses = PoseSequence(
        joints=points[..., :2],
        layout=layout,
        frame=IMAGE,
        confidence=confidence,
        frame_index=frames,
        person=person,
    )
    return poses.noted("scores", **said) if said else poses


def saying_nothing(scores: np.ndarray) -> str:
    """Why the scores (...,) of all joints of a file say nothing about any, such as "all are 1"; "" when they say
    something.

    They say nothing when they are one number within [0, 1], the range of confidences, to which others are clipped.
    """
    known = scores[np.isfinite(scores)]
    if len(known) < 2:
        return ""
    low, high = known.min(), known.max()
    if np.clip(low, 0, 1) != np.clip(high, 0, 1):
        return ""
    return f"all are {low:g}" if low == high else f"all are {low:g} to {high:g}"


def _by_name(detections: Iterable[Detection]) -> dict[str, list[int]]:
    """The rows of each person whom the detector names."""
    people: dict[str, list[int]] = defaultdict(list)
    for row, detection in enumerate(detections):
        people[str(detection.person)].append(row)
    return people


def _linked(frames: np.ndarray, points: np.ndarray) -> Mapping[str, Sequence[int]]:
    """Rows of people named "0", "1", ... in order of appearance, as `followed`; where no frame holds more than one
    person, all are one, though `leap` may doubt it. A row without a single joint is dropped."""
    seen = np.flatnonzero(is_finite(points).any(axis=1))
    if len(np.unique(frames[seen])) == len(seen):
        return {"0": seen.tolist()}
    return followed(frames, points)


def followed(frames: np.ndarray, points: np.ndarray) -> dict[str, array[int]]:
    """Rows of each person in order of time, by what they show in the image plane: frames (N,) and points (N, J, 2)
    of all sightings, NaN where missing. A `Tracker` joins each to the nearest of the frames before; a row without
    a point is nobody."""
    people: dict[str, array[int]] = defaultdict(lambda: array("q"))
    tracker, there = Tracker(), is_finite(points)
    ordered = np.argsort(frames, kind="stable").tolist()
    for frame, everybody in groupby(ordered, key=frames.__getitem__):
        rows = [row for row in everybody if there[row].any()]
        names = tracker.names([sighted(int(frame), points[row], there[row]) for row in rows])
        for row, name in zip(rows, names, strict=True):
            people[str(name)].append(row)
    return people


def _sure_leap(poses: PoseSequence) -> list[Notice]:
    """`leap` among the rows whose joints score half as much as usual, or are not scored: a detector that is lost for a
    frame puts a body anywhere."""
    score = np.nan_to_num(poses.confidence)
    sure = score.sum(axis=1) >= _SURE * (np.isfinite(poses.confidence) @ np.median(score, axis=0))
    return leap(poses.frame_index[sure], poses.joints[sure])


def leap(frames: np.ndarray, points: np.ndarray) -> list[Notice]:
    """A notice where one track leaps so far that it may be somebody else; none where not.

    frames: (T,) increasing; points: (T, J, 2) in the image or in any plane, NaN where missing. The distance is that of
    a `Tracker`, which may be half the body's size, and more after frames in which nobody was seen. Who leaps stays one
    person all the same, for a cut or a camera that turns fast does that too.
    """
    if len(frames) < 2:
        return []
    starts = range(0, len(frames) - 1, _PIECE)  # hours of video at once would double the memory
    far = np.concatenate([steps(points[start : start + _PIECE + 1]) for start in starts])
    unseen = np.diff(frames) - 1
    far = np.where(far < REACH + _WANDER * unseen, 0, far)
    row = int(far.argmax())
    if far[row] == 0:
        return []
    where: dict[str, Any] = {"sizes": float(far[row]), "frame": int(frames[row + 1])}
    if unseen[row]:
        return [notice("leap-after-gap", **where, unseen=int(unseen[row]))]
    return [notice("leap-between-people", **where)]
