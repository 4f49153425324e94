"""A detector over a whole video: people followed under their names, cuts noticed, stopped and taken up again."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np

from ..pipeline.detections import Detections
from ..pipeline.errors import InputError
from ..pipeline.interrupt import interruptible
from ..pipeline.pictures import pictures
from ..pipeline.progress import counted
from ..pipeline.take import Video
from .cuts import is_cut, shows, thumbnail
from .detection import Detector, Found
from .tracking import Sighting, Tracker


class _Rows:
    """What was found so far, in flat buffers: hours of video are many small arrays."""

    def __init__(self, joints: int) -> None:
        self._joints = joints
        self.frame, self.person = array("q"), array("q")
        self._xy, self._score, self._box = array("f"), array("f"), array("f")

    def add(self, frame: int, person: int, found: Found) -> None:
        self.frame.append(frame)
        self.person.append(person)
        for buffer, values in ((self._xy, found.xy), (self._score, found.score), (self._box, found.box)):
            buffer.frombytes(values.tobytes())

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Copies, by their names in Detections."""
        return {
            "frame_index": np.array(self.frame, np.int64),
            "person": np.array(self.person, np.int64),
            "joints": np.array(self._xy, np.float32).reshape(-1, self._joints, 2),
            "confidence": np.array(self._score, np.float32).reshape(-1, self._joints),
            "box": np.array(self._box, np.float32).reshape(-1, 4),
        }


def detect(
    video: Video, detector: Detector, source: str = "", resume: Detections | None = None
) -> Detections:
    """Everybody in a video. source: what a later run compares before it goes on with these.

    Ctrl-C ends it early: what was found so far comes back, with `frames_seen` less than `frames`. resume: such an
    answer to go on from; the result is the same as in one go. Memory grows by what was found alone. InputError when
    the video cannot be decoded, or `resume` is of something else.
    """
    rows, tracker, before, first, cuts, small = _taken_up(video, detector, source, resume)
    total = len(video.time_s)
    seen = first
    with interruptible() as asked, counted("detect", total) as count:
        for number, picture in pictures(video, first):
            now = thumbnail(picture)
            if small is not None and is_cut(small, now):
                cuts.append(number)
                tracker.cut()
                before = ()
            small = now if small is None or shows(now) else small
            before = detector.people(picture, before)
            for name, person in zip(tracker.names(number, before), before, strict=True):
                rows.add(number, name, person)
            seen = number + 1
            count(seen)
            if asked():
                break
        else:
            seen = total
    found = rows.arrays
    return Detections(
        **found,
        time_s=video.time_s[found["frame_index"]],
        cuts=np.array(cuts, dtype=np.int64),
        thumbnail=np.zeros((0, 0), np.uint8) if small is None else small,
        frames=total,
        frames_seen=seen,
        layout=detector.layout.name,
        method=detector.method,
        source=source,
    )


def _taken_up(
    video: Video, detector: Detector, source: str, resume: Detections | None
) -> tuple[_Rows, Tracker, Sequence[Found], int, list[int], np.ndarray | None]:
    """Where to begin: what is known, and the state of everything after the last frame that was looked at."""
    rows = _Rows(len(detector.layout))
    if resume is None:
        return rows, Tracker(), (), 0, [], None
    if (resume.source, resume.method, resume.frames) != (source, detector.method, len(video.time_s)):
        raise InputError(
            f"What was detected before is of another video, detector or version ({resume.method} on {resume.frames} "
            f"frames, now {detector.method} on {len(video.time_s)}); leave --resume out to begin anew."
        )
    scene = int(resume.cuts.max(initial=0))
    last: dict[int, Sighting] = {}
    before = []
    columns = (resume.frame_index, resume.person, resume.joints, resume.confidence, resume.box)
    for frame, person, xy, score, box in zip(*columns, strict=True):
        found = Found(xy, score, box)
        rows.add(frame, person, found)
        if frame >= scene:
            last.pop(person, None)
            last[person] = Sighting(person, frame, found)
        if frame == resume.frames_seen - 1:
            before.append(found)
    tracker = Tracker(list(last.values()), int(resume.person.max()) + 1)
    small = resume.thumbnail if resume.thumbnail.size else None
    return rows, tracker, before, resume.frames_seen, resume.cuts.tolist(), small
