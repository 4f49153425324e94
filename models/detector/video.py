"""A detector over a whole video: people followed under their names, cuts and repeated images noticed, stopped and taken
up again."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.messages import how_many
from ...pipeline.core.take import Video
from ...pipeline.files.detections import Detections
from ...pipeline.files.video_frames import images_ahead
from ...pipeline.reading.people import MEMORY, Sighting, Tracker
from ...pipeline.running.progress import Keeper, counted, interruptible
from ...pipeline.signals.visibility import LEAST_SCORE
from .protocols import Detector, Found
from .scene_cuts import Glance, exchanges, leaps, repeated, without_repeats

_UNSEEN_S = 0.2  # somebody may be in view for so long before they are looked for
_LAST = 10  # images that show how far the film leaps without a cut: a recording that stalls does so again and again
_AGAIN = 30  # images before an interruption that are seen again at a time


class Search:
    """People followed under their names from image to image, cuts noticed; what was found so far.

    cuts: frames that begin another scene. damaged: frames whose data the decoder calls corrupt, some of them perhaps
    not looked at yet. seen: frames up to the last image.

    To find nobody takes longest: once everybody has been lost for as long as names are kept, people are looked for in
    one of `every` frames.
    """

    def __init__(self, detector: Detector, first: int = 0, every: int = 1) -> None:
        self.cuts: list[int] = []
        self.damaged: list[int] = []
        self.seen = first
        self._every = every
        self._last = first  # frame with anybody, or the first of a scene
        self._detector = detector
        # In flat buffers, a row a person and image: hours of video would be many small arrays.
        self._whose, self._found = array("d"), array("f")
        self._tracker = Tracker()
        self._before: Sequence[Found] = ()
        self._glance: Glance | None = None
        self._change = array("f")

    def look(self, number: int, time_s: float, image: np.ndarray) -> list[tuple[int, Found]]:
        """The people in the next frame, each with the name it goes by."""
        now = Glance.at(image)
        self._change.extend([np.nan] * (number + 1 - len(self._change)))
        before = float(np.max(self._change[max(number - _LAST, 0) : number], initial=0.0))
        if self._glance is not None and self._glance.is_cut_to(now, before):
            self.cuts.append(number)
            self._tracker.cut()
            self._before = ()
            self._last = number
        elif self._glance is not None:
            self._change[number] = self._glance.change_to(now)
        if self._glance is None or now.shows:
            self._glance = now
        alone = number - self._last
        self._before = () if alone > MEMORY and alone % self._every else self._people(image, number)
        if self._before:
            self._last = number
        names = self._tracker.names([_sighting(number, sighted) for sighted in self._before])
        named = list(zip(names, self._before, strict=True))
        for name, person in named:
            self._keep(number, time_s, name, person)
        self.seen = number + 1
        return named

    def _keep(self, frame: int, time_s: float, person: int, sighted: Found) -> None:
        self._whose.extend((frame, time_s, person))
        for values in (sighted.xy, sighted.score, sighted.box):
            self._found.frombytes(values.tobytes())

    def _people(self, image: np.ndarray, number: int) -> Sequence[Found]:
        """InputError for a detector of another package that answers something else, and for a function that fails."""
        try:
            people, joints = self._detector.people(image, self._before), len(self._detector.layout)
        except InputError as error:
            raise InputError(error.code, f"In frame {number}: {error}") from error.__cause__
        shapes = [(joints, 2), (joints,), (4,)]
        if isinstance(people, Sequence) and all(
            isinstance(person, Found)
            and [each.shape for each in (person.xy, person.score, person.box)] == shapes
            for person in people
        ):
            return people
        raise InputError(
            "plugin-broken",
            f"Expected from the detector {self._detector.method} a tuple with a Found for each person, of xy "
            f"({joints}, 2), score ({joints},) and box (4,), got something else: repair its package.",
        )

    def detections(self, frames: int, seen: int, source: str = "") -> Detections:
        """All that was found in the first `seen` of so many frames. source: what a later run compares before it goes
        on with these."""
        change, count = np.array(self._change, np.float32), len(self._detector.layout)
        frame, time_s, person = np.array(self._whose).reshape(-1, 3).T
        rows = np.array(self._found, np.float32).reshape(-1, 3 * count + 4)
        joints, confidence, box = np.split(rows, (2 * count, 3 * count), axis=1)
        return Detections(
            frame_index=frame.astype(np.int64),
            time_s=time_s,
            person=person.astype(np.int64),
            joints=joints.reshape(-1, count, 2),
            confidence=confidence,
            box=box,
            cuts=np.array(self.cuts, dtype=np.int64),
            damaged=np.array([number for number in self.damaged if number < self.seen], dtype=np.int64),
            repeated=repeated(change),
            change=change,
            frames=frames,
            frames_seen=seen,
            layout=self._detector.layout.name,
            method=self._detector.method,
            source=source,
        )

    def take_up(self, resume: Detections, last: Glance | None) -> None:
        """Know what is known, and be in the state of after the last frame that was looked at. last: what the next image
        is compared with."""
        scene = int(resume.cuts.max(initial=0))
        before = []
        sightings = map(Found, resume.joints, resume.confidence, resume.box)
        rows = zip(resume.frame_index, resume.time_s, resume.person, sightings, strict=True)
        for frame, time_s, person, sighted in rows:
            self._keep(frame, time_s, person, sighted)
            self._tracker.knows(int(person), _sighting(int(frame), sighted))
            if frame < scene:
                self._tracker.cut()
            if frame == resume.frames_seen - 1:
                before.append(sighted)
        self._before = before
        self._glance = last
        self._change = array("f", resume.change.tolist())
        self.cuts, self.damaged = resume.cuts.tolist(), resume.damaged.tolist()
        self.seen = resume.frames_seen
        self._last = int(resume.frame_index.max(initial=max(scene, self._last)))


def _sighting(frame: int, sighted: Found) -> Sighting:
    # Who is all unsure is somewhere too.
    return Sighting(frame, sighted.xy, sighted.score + 1e-6, sighted.box)


def detect(
    video: Video,
    detector: Detector,
    source: str = "",
    resume: Detections | None = None,
    keep: Callable[[Detections], None] = lambda detections: None,
) -> Detections:
    """Everybody in the video's span. source: what a later run compares before it goes on with these. keep: called with
    what was found so far, about every minute and at the end.

    Ctrl-C ends it early: what was found so far comes back, with `frames_seen` less than `frames`. resume: what was
    kept, to go on from; the result is the same as in one go. In the answer alone repeated images are left out, and who
    is exchanged with somebody else, or goes on behind a leap of the image, is told apart. Memory grows by what was
    found alone. InputError when the video cannot be decoded, or not one image of it, or `resume` is of something else.
    """
    first, total = video.span[0], video.span[1] + 1
    every = max(int(_UNSEEN_S * video.fps), 1) if total > 1 else 1
    search = Search(detector, first, every)
    if resume is not None:
        if (resume.source, resume.method, resume.frames) != (source, detector.method, total):
            raise InputError(
                "files-apart",
                f"What was detected before is of another video, detector or version ({resume.method} on "
                f"{how_many(resume.frames, 'frame')}, now {detector.method} on {total}); leave --resume out to start "
                "again.",
            )
        search.take_up(resume, _glance_before(video, first, resume.frames_seen))
    seen = total

    kept = Keeper(lambda: keep(search.detections(total, search.seen, source)))
    with interruptible() as asked, counted("detect", total - first) as count:
        for number, image in images_ahead(video, search.seen, total - 1, search.damaged):
            search.look(number, float(video.time_s[number]), image)
            count(search.seen - first)
            if asked():
                seen = search.seen
                break
            kept()
    if search.seen == first:
        raise InputError(
            "file-damaged",
            f"Expected images in {video.path}, but not one of its {how_many(total - first, 'frame')} can be decoded; "
            "rewrite the video with ffmpeg, for example as H.264 in an .mp4.",
        )
    detections = search.detections(total, seen, source)
    keep(detections)
    return _told_apart(without_repeats(detections))


def _glance_before(video: Video, first: int, number: int) -> Glance | None:
    """What an image of that number is compared with, which no file keeps: the last image before it that shows anything,
    however long it has been dark, else the first of all."""
    glance = None
    while number > first:
        start = max(first, number - _AGAIN)
        for glance in reversed([Glance.at(image) for _, image in images_ahead(video, start, number - 1, [])]):
            if glance.shows:
                return glance
        number = start
    return glance


def _told_apart(detections: Detections) -> Detections:
    """The same, with who goes on as somebody else in the middle of a track, or behind a cut within the scene, under a
    name of their own. Joints that nobody saw, of legs out of the image, are guessed now here, now there, and tell
    nothing."""
    cuts = leaps(detections)
    visible = np.where((detections.confidence < LEAST_SCORE)[..., None], np.nan, detections.joints)
    pieces = []
    for name in np.unique(detections.person):
        rows = np.flatnonzero(detections.person == name)
        others = [row for row, _ in exchanges(detections.time_s[rows], visible[rows].astype(np.float64))]
        others += np.searchsorted(detections.frame_index[rows], cuts).tolist()
        pieces += [piece for piece in np.split(rows, sorted(others)) if len(piece)]
    person = np.empty_like(detections.person)
    for name, rows in enumerate(sorted(pieces, key=lambda rows: int(rows[0]))):
        person[rows] = name
    return replace(detections, person=person, cuts=np.union1d(detections.cuts, cuts))
