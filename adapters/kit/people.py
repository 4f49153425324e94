"""Sightings, one person in one moment each, become one pose sequence a person; compact enough for hours of video."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import IMAGE, Frame
from ...pipeline.core.layouts import IN_2D, WHOLE_BODIES, Layout, layouts_of
from ...pipeline.core.messages import how_many
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.reading.joint_order import likely_layout
from ...pipeline.reading.people import REACH, Tracker, sighted, steps
from .clock import Clock

COUNTS = (*sorted({*map(len, IN_2D)}), *WHOLE_BODIES)
_FLAGS = (0, 1, 2)  # COCO's, in place of scores: not labelled, hidden, visible
_MOST_IN_FRAME, _MOST_NAMES = 500, 5_000  # more than detectors find in a crowd, or trackers name in a day
_WANDER = 0.05  # of the body's size a frame: how much further somebody may get unseen, running at 2.5 m/s and 30 fps
_SURE = 0.5  # of a joint's usual score
_PIECE = 10_000  # frames whose steps are looked at together
_BY_POSE = "nearest pose"


class People:
    """Everybody in a file, in its order, collected in flat buffers while it is read."""

    def __init__(self, where: str) -> None:
        """where: the file, for errors."""
        self._where = where
        self._joints, self._dims = 0, 0
        self._moments = array("q")
        self._points, self._scores, self._boxes = array("f"), array("f"), array("f")
        self._rows_of: dict[str, array] = defaultdict(lambda: array("q"))  # of people whom the file names
        self._crowd = 0  # people of the last moment so far

    def add(
        self,
        moment: int,
        points: np.ndarray,
        scores: np.ndarray | None = None,
        person: str | None = None,
        box: np.ndarray | None = None,
    ) -> None:
        """One person in one moment of a clock, or in one video frame.

        points: (J, 2) pixels, or (J, 3), NaN where missing. scores: (J,), None when unknown. person: as the file names
        everybody, None where it names nobody. box: (4,) in the image, left, top, right, bottom, None when unknown.
        InputError for another number of joints than before, and, before the memory is full, for a crowd: from 500
        people in a frame, or 5,000 by name, on.
        """
        if not self._joints:
            self._joints, self._dims = points.shape
        if points.shape != (self._joints, self._dims):
            raise InputError(
                "wrong-content",
                f"{self._where}: expected people of as many joints throughout, got {self._joints} and {len(points)}.",
            )
        if person is not None:
            self._rows_of[person].append(len(self._moments))
        self._crowd = self._crowd + 1 if self._moments and moment == self._moments[-1] else 1
        if self._crowd > _MOST_IN_FRAME:
            raise self._crowded(f"{_MOST_IN_FRAME} people in a frame, got more in frame {moment}")
        if len(self._rows_of) > _MOST_NAMES:
            raise self._crowded(f"{_MOST_NAMES} people, got more by frame {moment}")
        self._moments.append(moment)
        scores = np.full(self._joints, np.nan) if scores is None else scores
        box = np.full(4, np.nan) if box is None else box
        for buffer, values in ((self._points, points), (self._scores, scores), (self._boxes, box)):
            buffer.frombytes(np.ascontiguousarray(values, dtype=np.float32).tobytes())

    def __len__(self) -> int:
        return len(self._moments)

    @property
    def points(self) -> np.ndarray:
        """(N, J, D) float32 of all sightings; writable. InputError for nobody at all."""
        if not len(self):
            raise self._nobody()
        return np.frombuffer(self._points, np.float32).reshape(len(self), self._joints, self._dims)

    @property
    def scores(self) -> np.ndarray:
        """(N, J) float32."""
        return np.frombuffer(self._scores, np.float32).reshape(len(self), self._joints)

    def keypoints(
        self, clock: Clock | None = None, layouts: Sequence[Layout] = IN_2D
    ) -> tuple[PoseSequence, ...]:
        """One sequence a person in IMAGE, frames in order, people in the order in which they appear.

        clock: of which the frames are moments. layouts: those that the format can hold, told apart by their number of
        joints, and those of one number by their bones. A joint at 0, 0 was not found: detectors write it for none, some
        of them with a score above 0 (Ultralytics' YOLO). InputError for nobody at all, for another layout, for
        coordinates that are no pixels, and for a person who is in a frame twice.
        """
        everybody, likely = self.points, layouts_of(self._joints, self._where, layouts)
        points, scores = everybody[:, : len(likely[0])], self.scores[:, : len(likely[0])]
        gone = np.isnan(points).any(axis=-1) | (points == 0).all(axis=-1)
        points[gone], scores[gone] = np.nan, np.nan
        if gone.all():
            raise self._nobody()
        if np.nanmax(np.abs(points)) <= 1:
            raise InputError(
                "wrong-axes",
                f"{self._where}: expected pixels, got coordinates between -1 and 1; write them in pixels of the video "
                "(OpenPose: --keypoint_scale 0).",
            )
        return self._sequences(points, scores, likely_layout(points, likely), IMAGE, clock, points, "nearest")

    def poses(
        self,
        layout: Layout,
        frame: Frame,
        clock: Clock | None = None,
        plane: tuple[int, int] = (0, 1),
        placed: bool = False,
    ) -> tuple[PoseSequence, ...]:
        """One sequence a person in a 3D frame, rows in order of time, people in the order in which they appear.

        layout: of the joints, or of the first ones. plane: the two coordinates that the image shows, by which people
        without boxes are told apart. placed: the joints say where in space the person is, not only the pose. Others and
        errors as for `keypoints`; the history says by what people without names were told apart.
        """
        points, scores = self.points[:, : len(layout)], self.scores[:, : len(layout)]
        boxes = np.frombuffer(self._boxes, np.float32).reshape(-1, 4)
        boxed = bool(np.isfinite(boxes).all() and np.ptp(boxes, axis=0).any())
        shown = boxes.reshape(-1, 2, 2) if boxed else points[..., plane]
        method = "nearest box" if boxed else "nearest position" if placed else _BY_POSE
        return self._sequences(points, scores, layout, frame, clock, shown, method)

    def without_flags(self) -> bool:
        """Whether all scores are COCO's flags of visibility; if so, joints that are not labelled become missing, and
        nothing is known of the others' certainty."""
        if not (len(self) and np.isin(self.scores, _FLAGS).all() and np.ptp(self.scores)):
            return False
        self.points[self.scores == 0] = np.nan
        self.scores[:] = np.nan
        return True

    def _nobody(self) -> InputError:
        return InputError("nothing-usable", f"{self._where}: no person was found in any frame.")

    def _crowded(self, what: str) -> InputError:
        return InputError(
            "unsafe",
            f"{self._where}: expected at most {what}, where reading stopped; keep only the people that you need in the "
            "file, or raise the detector's threshold.",
        )

    def _sequences(
        self,
        points: np.ndarray,
        scores: np.ndarray,
        layout: Layout,
        frame: Frame,
        clock: Clock | None,
        shown: np.ndarray,
        method: str,
    ) -> tuple[PoseSequence, ...]:
        """Everybody, of points (N, J, D) with scores (N, J), of which those outside [0, 1] are clipped.

        People without names are told apart by nearness, in words `method`, of what is shown (N, K, 2) in the image,
        where several are in a frame; where some have a name, those without are left out, for trackers name nobody where
        they are not sure. Somebody who is alone, or whom a tracker names, is doubted at a `leap`. InputError when
        somebody is in a frame twice.
        """
        moments = np.frombuffer(self._moments, np.int64)
        if np.unique(moments, return_counts=True)[1].max() > _MOST_IN_FRAME:
            raise self._crowded(f"{_MOST_IN_FRAME} people in a frame")
        frames = moments if clock is None else clock.index[moments]
        visible = np.arange(len(frames))  # in 3D a row without a pose is a gap, and counted
        if frame is IMAGE:
            visible = np.flatnonzero(is_finite(shown).any(axis=1))
        several = not self._rows_of and len(np.unique(frames[visible])) < len(visible)
        linked = several or (not self._rows_of and frame is IMAGE)
        rows_of: Mapping[str, Any] = self._rows_of or {"0": visible}
        if several:
            rows_of = followed(frames, shown)
        unknown = saying_nothing(scores)
        unnamed = len(self) - sum(map(len, self._rows_of.values())) if self._rows_of else 0
        people = []
        for person, rows in sorted(rows_of.items(), key=lambda item: moments[np.asarray(item[1])].min()):
            rows = np.asarray(rows)
            rows = rows[np.argsort(frames[rows], kind="stable")]
            if len(rows) == len(frames) and (np.diff(rows) == 1).all():
                rows = slice(None)  # a view, for an index would copy hours of video
            self._refuse_twice(person, frames[rows], frame)
            own = scores[rows]
            confidence = np.full_like(own, np.nan) if unknown else np.clip(own, 0, 1)
            poses = PoseSequence(
                points[rows],
                layout,
                frame,
                confidence,
                frame_index=frames[rows],
                person=person,
                linked=linked,
            )
            clipped = int(((own < 0) | (own > 1)).sum())
            if unknown:
                poses = poses.noted("scores", unknown=unknown)
            elif clipped:
                poses = poses.noted("scores", clipped=clipped, highest=float(np.nanmax(own)))
            if unknown == "all are 0" and frame is IMAGE:
                poses = poses.saying(notice("scores-all-zero"))
            if linked:
                poses = poses.noted("link people", method=method)
            if several and method == _BY_POSE:
                poses = poses.saying(notice("people-by-poses-alone"))
            elif not several and method != _BY_POSE:
                poses = poses.saying(*leap(frames[rows], shown[rows], confidence))
            if unnamed:
                no_track = notice("no-track-number", unnamed=unnamed, detections=len(self))
                poses = poses.noted("track numbers", left_out=unnamed).saying(no_track)
            if clock is not None:
                time_s = None if clock.time_s is None else clock.time_s[moments[rows]]
                poses = poses.with_(time_s=time_s, frames_known=clock.known).saying(*clock.notices)
            people.append(poses)
        return tuple(people)

    def _refuse_twice(self, person: str, frames: np.ndarray, frame: Frame) -> None:
        """frames: (T,) of one person, in order. frame: the axes of the poses."""
        twice = frames[1:][np.diff(frames) == 0]
        if len(twice):
            flag = "--set keypoints." if frame is IMAGE else "-O "
            raise InputError(
                "people-mixed",
                f"{self._where}: expected each person once a frame, got person {person} more than once in frame "
                f"{twice[0]}, so people are not tracked in this file; track them in the program that wrote it, or "
                f"pass track=true ({flag}track=true), where its adapter has that, to join each one to the nearest "
                "of the frames before.",
            )


def in_pixels(shares: np.ndarray, image_size: tuple[int, int] | None, where: str) -> np.ndarray:
    """Shares of an image's width and height (..., 2) as pixels; InputError where its size is not known."""
    if image_size is None:
        raise InputError(
            "needs-input",
            f"{where}: expected pixels, got shares of the image's width and height; give the video, or the size of "
            "its images (--set read.image_size=1920x1080, of inspect -O image_size=1920,1080).",
        )
    return shares * image_size


def saying_nothing(scores: np.ndarray) -> str:
    """Why the scores (...,) of all joints of a file say nothing about any, such as "all are 1"; "" when they say
    something.

    They say nothing when they are one number within [0, 1], the range of confidences, to which others are clipped.
    """
    stated = scores[np.isfinite(scores)]
    if len(stated) < 2:
        return ""
    low, high = stated.min(), stated.max()
    if np.clip(low, 0, 1) != np.clip(high, 0, 1):
        return ""
    return f"all are {low:g}" if low == high else f"all are {low:g} to {high:g}"


def followed(frames: np.ndarray, points: np.ndarray) -> dict[str, array[int]]:
    """Rows of each person in order of time, by what they show in the image plane: frames (N,) and points (N, J, 2)
    of all sightings, NaN where missing. A `Tracker` joins each to the nearest of the frames before; a row without
    a point is nobody."""
    people: dict[str, array[int]] = defaultdict(lambda: array("q"))
    tracker, visible = Tracker(), is_finite(points)
    ordered = np.argsort(frames, kind="stable").tolist()
    for frame, everybody in groupby(ordered, key=frames.__getitem__):
        rows = [row for row in everybody if visible[row].any()]
        names = tracker.names([sighted(int(frame), points[row], visible[row]) for row in rows])
        for row, name in zip(rows, names, strict=True):
            people[str(name)].append(row)
    return people


def leap(frames: np.ndarray, points: np.ndarray, confidence: np.ndarray) -> list[Notice]:
    """A notice where one track leaps so far that it may be somebody else; none where not.

    frames: (T,) increasing; points: (T, K, 2) in the image or in any plane, NaN where missing; confidence: (T, J). The
    distance is that of a `Tracker`, which may be half the body's size, and more after frames in which nobody was seen.
    Rows whose joints score less than half as much as usual do not count: a detector that is lost for a frame puts a
    body anywhere. Who leaps stays one person all the same, for a cut or a camera that turns fast does that too.
    """
    score = np.nan_to_num(confidence)
    sure = score.sum(axis=1) >= _SURE * (np.isfinite(confidence) @ np.median(score, axis=0))
    frames, points = frames[sure], points[sure]
    unseen = np.diff(frames) - 1
    starts = range(0, max(len(frames) - 1, 1), _PIECE)  # hours of video at once would double the memory
    far = np.concatenate([steps(points[start : start + _PIECE + 1]) for start in starts])
    far = np.where(far < REACH + _WANDER * unseen, 0, far)
    if not far.any():
        return []
    row = int(far.argmax())
    where: dict[str, Any] = {"sizes": float(far[row]), "frame": int(frames[row + 1])}
    after = f", after {how_many(int(unseen[row]), 'frame')} unseen" if unseen[row] else ""
    return [notice("leap-between-people", **where, unseen=after)]
