"""3D bodies, one person in one frame each, become one pose sequence a person; compact enough for hours of video."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.frames import Frame
from ...pipeline.core.layouts import Layout
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence, Step, package_version
from ...pipeline.core.rotations import is_finite
from .tracks import Crowd, Detection, followed, leap, saying_nothing


@dataclass(frozen=True, eq=False, kw_only=True)
class _Seen(Detection):
    """A body by what it shows in the image plane; row: its place among the bodies."""

    row: int

    @cached_property
    def found(self) -> np.ndarray:
        """(J,) whether the point is there: 0, 0 is a place in space, and a box's corner."""
        return is_finite(self.points)


class Bodies:
    """Bodies of one layout in the order of a file, collected in flat buffers while it is read."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self._crowd = Crowd("The file of poses")
        self._frames, self._joints, self._scores, self._boxes = array("q"), array("f"), array("f"), array("f")

    def add(
        self, frame: int, joints: np.ndarray, scores: np.ndarray | None = None, box: np.ndarray | None = None
    ) -> None:
        """joints (J, 3); scores (J,), None when unknown; box (4,) in the image, x1, y1, x2, y2, None when unknown.
        InputError for too many people (`Crowd`)."""
        self._crowd.add(frame)
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
        self, frame: Frame, plane: tuple[int, int], where: str, placed: bool = False
    ) -> tuple[PoseSequence, ...]:
        """One sequence a person in `frame`, rows in order of time, people in the order in which they appear.

        plane: the two coordinates that the image shows, by which people without boxes are told apart.
        placed: the joints say where in space the person is, not only the pose.
        People are joined from frame to frame by `_tracks.followed`; the history says by what. Scores that say nothing
        (`saying_nothing`) become NaN, others outside [0, 1] are clipped; the history tells both. InputError when
        nobody is there.
        """
        if not self._frames:
            raise InputError(f"{where}: no person was found in any frame.")
        frames = np.frombuffer(self._frames, np.int64)
        scores = np.frombuffer(self._scores, np.float32).reshape(len(frames), -1)
        unknown = saying_nothing(scores)
        groups, how, doubts = self._groups(frames, plane, placed)
        people = []
        for person, rows in enumerate(groups):
            own = scores[rows]
            steps = list(how)
            outside = (own < 0) | (own > 1)
            if unknown:
                steps.append(Step("scores", package_version(), {"unknown": unknown}))
                own = np.full_like(own, np.nan)
            elif outside.any():
                counts = {"clipped": int(outside.sum()), "highest": float(np.nanmax(own))}
                steps.append(Step("scores", package_version(), counts))
                own = np.clip(own, 0, 1)
            people.append(
                PoseSequence(
                    joints=self.joints[rows],
                    layout=self.layout,
                    frame=frame,
                    confidence=own,
                    frame_index=frames[rows],
                    person=str(person),
                    history=tuple(steps),
                    notices=tuple(doubts),
                    linked=bool(how),
                )
            )
        return tuple(people)

    def _groups(
        self, frames: np.ndarray, plane: tuple[int, int], placed: bool
    ) -> tuple[list[np.ndarray | slice], tuple[Step, ...], list[Notice]]:
        """Each person's rows in order of time, the step of the history that says how they were found, where there was
        somebody to tell apart, and what casts doubt on it."""
        boxes = np.frombuffer(self._boxes, np.float32).reshape(-1, 4)
        boxed = bool(np.isfinite(boxes).all() and np.ptp(boxes, axis=0).any())
        alone = len(np.unique(frames)) == len(frames)
        if alone and not boxed and not placed:
            return [_in_order(frames)], (), []
        points = boxes.reshape(-1, 2, 2) if boxed else self.joints[..., plane]
        if alone:
            rows = _in_order(frames)
            return [rows], (), leap(frames[rows], points[rows])
        method = "nearest box" if boxed else "nearest position" if placed else "nearest pose"
        doubts = [] if boxed or placed else [notice("people-by-poses-alone")]
        people: dict[str | None, array] = defaultdict(lambda: array("q"))
        for one in followed(_seen(frames, points)):
            people[one.person].append(one.row)
        steps = (Step("link people", package_version(), {"method": method}),)
        return [np.frombuffer(rows, np.int64) for rows in people.values()], steps, doubts


def _in_order(frames: np.ndarray) -> np.ndarray | slice:
    """The rows in order of time: a view where they are so already, for an index would copy hours of video."""
    return slice(None) if (np.diff(frames) > 0).all() else np.argsort(frames)


def _seen(frames: np.ndarray, points: np.ndarray) -> Iterator[list[_Seen]]:
    """The bodies of each frame, in order of time; points (bodies, N, 2) are what each shows in the image plane."""
    ordered = np.argsort(frames, kind="stable").tolist()
    for frame, rows in groupby(ordered, key=frames.__getitem__):
        bodies = [
            _Seen(int(frame), np.column_stack([points[row], np.ones(len(points[row]))]), row=row)
            for row in rows
        ]
        if found := [body for body in bodies if body.found.any()]:
            yield found
