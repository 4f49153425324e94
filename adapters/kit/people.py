"""3D bodies, one person in one frame each, become one pose sequence a person; compact enough for hours of video."""

from __future__ import annotations

from array import array
from collections import defaultdict

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import Frame
from ...pipeline.core.layouts import Layout
from ...pipeline.core.notices import notice
from ...pipeline.core.pose import PoseSequence
from .clock import Clock
from .tracks import Crowd, confidences, followed, leap, once_a_frame, saying_nothing


class Bodies:
    """Bodies of one layout in the order of a file, collected in flat buffers while it is read."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._crowd = Crowd("The file of poses")
        self._frames, self._joints, self._scores, self._boxes = array("q"), array("f"), array("f"), array("f")
        self._rows_of: dict[str, array] = defaultdict(lambda: array("q"))  # of people whom the file names

    def add(
        self,
        frame: int,
        joints: np.ndarray,
        scores: np.ndarray | None = None,
        box: np.ndarray | None = None,
        person: str | None = None,
    ) -> None:
        """joints (J, 3); scores (J,), None when unknown; box (4,) in the image, x1, y1, x2, y2, None when unknown;
        person: as the file names everybody, None where it names nobody. InputError for too many people (`Crowd`)."""
        self._crowd.add(frame, person)
        if person is not None:
            self._rows_of[person].append(len(self._frames))
        count = len(self.layout)
        scores = np.full(count, np.nan) if scores is None else scores
        box = np.full(4, np.nan) if box is None else box
        self._frames.append(frame)
        for buffer, values in ((self._joints, joints), (self._scores, scores), (self._boxes, box)):
            buffer.frombytes(np.ascontiguousarray(values, dtype=np.float32).tobytes())

    @property
    def joints(self) -> np.ndarray:
        """(bodies, J, 3) float32."""
        return np.frombuffer(self._joints, np.float32).reshape(-1, len(self.layout), 3)

    def sequences(
        self,
        frame: Frame,
        where: str,
        plane: tuple[int, int] = (0, 1),
        placed: bool = False,
        clock: Clock | None = None,
    ) -> tuple[PoseSequence, ...]:
        """One sequence a person in `frame`, rows in order of time, people in the order in which they appear.

        clock: of which the frames of the bodies are moments; without it they are the video's frames.
        plane: the two coordinates that the image shows, by which people without boxes are told apart.
        placed: the joints say where in space the person is, not only the pose.
        People without names are joined from frame to frame by a `Tracker`; the history says by what. Scores are taken
        for `confidences`. InputError when nobody is there, and when somebody is in a frame twice.
        """
        if not self._frames:
            raise InputError("nothing-usable", f"{where}: no person was found in any frame.")
        frames = np.frombuffer(self._frames, np.int64)
        frames = frames if clock is None else clock.index[frames]
        scores = np.frombuffer(self._scores, np.float32).reshape(len(frames), -1)
        unknown = saying_nothing(scores)
        boxes = np.frombuffer(self._boxes, np.float32).reshape(-1, 4)
        boxed = bool(np.isfinite(boxes).all() and np.ptp(boxes, axis=0).any())
        points = boxes.reshape(-1, 2, 2) if boxed else self.joints[..., plane]
        method, groups = "", dict(self._rows_of)
        if not groups and len(np.unique(frames)) == len(frames):
            groups = {"0": slice(None)}
        elif not groups:
            method = "nearest box" if boxed else "nearest position" if placed else "nearest pose"
            groups = followed(frames, points)
        unnamed = len(frames) - sum(map(len, self._rows_of.values())) if self._rows_of else 0
        nobody = [notice("no-track-number", unnamed=unnamed, detections=len(frames))] if unnamed else []
        people = []
        for person, rows in groups.items():
            rows = _in_order(rows, frames)
            once_a_frame(frames[rows], person, where, "-O track=true")
            confidence, said = confidences(scores[rows], unknown)
            poses = PoseSequence(
                joints=self.joints[rows],
                layout=self.layout,
                frame=frame,
                confidence=confidence,
                frame_index=frames[rows],
                person=person,
                linked=bool(method),
            )
            if method:
                poses = poses.noted("link people", method=method)
                poses = poses if boxed or placed else poses.saying(notice("people-by-poses-alone"))
            elif boxed or placed:
                poses = poses.saying(*leap(frames[rows], points[rows]))
            poses = poses.saying(*nobody)
            people.append(poses.noted("scores", **said) if said else poses)
        return tuple(people if clock is None else map(clock.on, people))


def _in_order(rows: array | slice, frames: np.ndarray) -> np.ndarray | slice:
    """The rows in order of time: a view where all are so already, for an index would copy hours of video."""
    if isinstance(rows, slice):
        return rows if (np.diff(frames) > 0).all() else np.argsort(frames)
    numbers = np.frombuffer(rows, np.int64)
    return numbers[np.argsort(frames[numbers], kind="stable")]
