"""Files become a take: video, keypoints and poses read; which frames of one are those of another, and at which second
each was taken."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.messages import how_many
from ..core.notices import Notice, notice, without_doubles
from ..core.pose import PoseSequence
from ..core.take import Take, Told, Video
from ..files.atomic import printable
from ..files.detections import FEWEST_FRAMES
from ..files.digest import sha256
from ..signals.altered import alterations, altered, without_altered
from ..signals.filters import nearest_row, rate
from ..signals.swaps import swaps_of_take
from .bounds import check_fps, check_times, image_size_doubts, rate_doubts
from .findings import UNNUMBERED, findings_of
from .load import Source, load, read_video
from .people import RANKS, choose_detected, choose_person, listed_people, rejoined
from .settings import RunOptions
from .together import together

Rows = PoseSequence | None  # of one person, where there is a file of them


@dataclass(frozen=True, eq=False)
class Files:
    """The files of one recording, with everybody in them. told: what the user says of it. first_frame: the video frame
    of the first row, where the user says it."""

    poses: Source | None
    keypoints: Source | None
    video: Video | None
    told: Told
    first_frame: int | None

    @property
    def lead(self) -> Source:
        """Whose people, frame numbers and clock count: the poses', or without poses the keypoints'."""
        lead = self.poses or self.keypoints
        if lead is None:
            raise InputError(
                "needs-input", "Expected poses or keypoints of several people, got a video alone."
            )
        return lead

    @cached_property
    def inputs(self) -> tuple[dict[str, Any], ...]:
        """Role, name, hash and adapter of each, those of poses first."""
        sources = {"poses": self.poses, "keypoints": self.keypoints, "video": self.video}
        return tuple(
            {
                "role": role,
                "file": printable(source.path.name),
                "sha256": (source.digest if isinstance(source, Source) else "") or sha256(source.path),
                "adapter": source.adapter if isinstance(source, Source) else "video",
            }
            for role, source in sources.items()
            if source is not None
        )

    @property
    def image_size(self) -> tuple[int, int] | None:
        """Width and height, from the video or the user."""
        return self.video.size if self.video else self.told.image_size

    @property
    def nameless(self) -> bool:
        """Whether equal names in both files say nothing, since one holds several people whom an adapter numbered by
        itself."""
        people = [person for file in (self.poses, self.keypoints) if file for person in file.people]
        return len(people) > 2 and any(person.linked for person in people)

    def seconds(self, frames: np.ndarray) -> np.ndarray | None:
        """(N,) of these video frames (N,), by the given rate or the video's own stamps; None where neither is known."""
        if self.told.fps is not None:
            return frames / check_fps(self.told.fps)
        return None if self.video is None else self.video.time_s[frames]

    def joined(self, poses: Rows, keypoints: Rows) -> tuple[Rows, Rows, list[Notice]]:
        """One person's, with numbers of video frames and seconds, and what is doubtful of the rate and of the image's
        size. InputError where the files do not go together, or nothing tells which frames the rows are, or when they
        were taken, and for keypoints outside their image."""
        poses, keypoints, numbering = self._numbered(poses, keypoints)
        lead = poses or keypoints
        assert lead is not None
        self._check_numbers(self.lead.path, lead, numbering)
        if keypoints is not None and self.keypoints is not None:
            self._check_numbers(self.keypoints.path, keypoints, self.keypoints)
        doubts = self._doubts(keypoints if keypoints and lead.time_s is None else lead)
        lead = self._timed(self.lead.path, lead, keypoints)
        clock = self.video.path if self.video and self.told.fps is None else self.lead.path
        check_times(lead.times, str(clock))
        if keypoints is not None:
            doubts += image_size_doubts(keypoints, self.image_size)
        if poses is None:
            return None, lead, doubts
        if keypoints is not None and self.keypoints is not None:
            keypoints = self._timed(self.keypoints.path, keypoints, lead)
        return lead, keypoints, doubts

    def _numbered(self, poses: Rows, keypoints: Rows) -> tuple[Rows, Rows, Source]:
        """Both with the numbers of their video frames, as far as the files and `first_frame` tell, and the file that
        numbers them."""
        first, numbering = self.first_frame, self.lead
        both = " and ".join(str(file.path) for file in (self.poses, self.keypoints) if file is not None)
        if poses is not None and not poses.frames_known:
            if keypoints is not None and self.keypoints and (first is None or len(poses) == len(keypoints)):
                poses, numbering = _numbered_by(keypoints, poses, both), self.keypoints
            elif first is not None:
                poses, first = _later(poses, first), None  # keypoints beside them have numbers of their own
            elif self.video is not None:
                poses = numbered_by_times(self.video, poses)
        if poses and keypoints and not np.isin(poses.frame_index, keypoints.frame_index).any():
            raise InputError("files-apart", f"{both} have no video frame in common.")
        if first is not None:
            # One shift for everybody in the file; rows without numbers are counted from 0, whoever is in the first.
            firsts = (int(each.frame_index[0]) if each.frames_known else 0 for each in numbering.people)
            by = first - min(firsts)
            poses, keypoints = (rows and _later(rows, by) for rows in (poses, keypoints))
        return poses, keypoints, numbering

    def _check_numbers(self, path: Path, rows: PoseSequence, numbering: Source) -> None:
        """InputError when nothing says which of the video's frames the rows are, or there are no such frames.
        numbering: the file that numbers the rows."""
        if self.video is None:
            return
        frames, last = len(self.video.time_s), int(rows.frame_index[-1])
        if path == self.lead.path and not rows.frames_known and len(rows) != frames:
            raise InputError(
                "needs-input",
                f"{path} has {how_many(len(rows), 'row')} without frame numbers, the video "
                f"{how_many(frames, 'frame')}; give the 2D file that the lifter was run on (--keypoints), or --set "
                "read.first_frame=N if the rows are consecutive.",
            )
        if last < frames:
            return
        lowest = min(int(person.frame_index[0]) for person in numbering.people)
        # The first images may show nobody, so that the lowest of numbers that count from 1 need not be 1.
        from_1 = lowest and last == frames and self.first_frame is None
        raise InputError(
            "files-apart",
            f"{path}, or the 2D file that numbers its rows, reaches video frame {last}, but {self.video.path} ends "
            f"with frame {frames - 1}; they do not belong together, unless the lowest number, {lowest}, is another "
            "video frame, as where numbers count from 1: then pass --set "
            f"read.first_frame={lowest - 1 if from_1 else 'N'}, that frame's number in the video.",
        )

    def _timed(self, path: Path, rows: PoseSequence, beside: Rows) -> PoseSequence:
        """The rows with their seconds: by the video or the given rate, else their own, else by those of other rows
        beside them. InputError when nothing tells the time."""
        frames = rows.frame_index
        if (time_s := self.seconds(frames)) is not None:
            return rows.with_(time_s=time_s)
        if rows.time_s is not None:
            return rows
        if beside is None or beside.time_s is None or len(beside) == 1:
            if len(frames) == 1:  # an image has no rate
                at = None if beside is None else beside.time_s
                return rows.with_(time_s=np.zeros(1) if at is None else at)
            raise InputError(
                "needs-rate",
                f"Nothing says at which rate {path} was recorded: give --fps F, or the video itself.",
            )
        first, last = beside.frame_index[[0, -1]]
        between = np.interp(frames, beside.frame_index, beside.times)
        outside = np.clip(frames - last, 0, None) + np.clip(frames - first, None, 0)
        return rows.with_(time_s=between + outside / beside.fps)

    def _doubts(self, rows: PoseSequence) -> list[Notice]:
        """Notices where the rate contradicts the video's or, without one, that of these rows; and where these two
        contradict each other."""
        stated = rows.fps if rows.time_s is not None and len(rows) > 1 else None
        fps = self.told.fps
        doubts = rate_doubts(fps, self.video, stated)
        if doubts or fps is not None or self.video is None or stated is None:
            return doubts
        first, last = rows.frame_index[[0, -1]]
        start_s, stop_s = self.video.time_s[[first, last]]
        shown = float((last - first) / (stop_s - start_s))  # of the same frames
        # A file that counts frames at the one rate of a video whose images come unevenly contradicts no more than that.
        most = limit("clocks-contradict.times")
        rates = (shown, self.video.fps, rate(self.video.time_s))
        if any(1 / most < stated / each < most for each in rates):
            return []
        return [notice("clocks-contradict", shown_fps=shown, stated_fps=stated, times=shown / stated)]


def _numbered_by(keypoints: PoseSequence, poses: PoseSequence, where: str) -> PoseSequence:
    """Poses without frame numbers with those of the 2D file. InputError where it has another number of rows."""
    if len(poses) != len(keypoints):
        raise InputError(
            "files-apart",
            f"{where} have {len(poses)} and {how_many(len(keypoints), 'row')}, and the poses have no frame numbers "
            "to match them by; give the 2D file that the lifter was run on, or leave --keypoints out.",
        )
    return poses.with_(frame_index=keypoints.frame_index, frames_known=keypoints.frames_known).noted(
        "frame numbers", source="keypoints"
    )


def numbered_by_times(video: Video, poses: PoseSequence) -> PoseSequence:
    """Poses without numbers with those of the video's frames at their own times, where they have times, each is within
    half an interval of one frame, and they last about as long as the video: a part's own clock may begin anew. A
    phone's video lacks images, which numbers counted by times would count."""
    if poses.time_s is None or len(video.time_s) < 2:
        return poses
    numbers = nearest_row(video.time_s, poses.time_s)
    off = np.abs(video.time_s[numbers] - poses.time_s)
    whole = numbers[-1] >= limit("frame-numbers.whole") * (len(video.time_s) - 1)
    if not whole or (off >= np.median(np.diff(video.time_s)) / 2).any() or (np.diff(numbers) <= 0).any():
        return poses
    return poses.with_(frame_index=numbers, frames_known=True).noted("frame numbers", source="times")


def _later(rows: PoseSequence, frames: int) -> PoseSequence:
    """The rows so many video frames later. InputError for a negative frame."""
    first = int(rows.frame_index[0]) + frames
    if first < 0:
        raise InputError("bad-value", f"Expected the first row at video frame 0 or later, got {first}.")
    numbers = rows.frame_index + frames
    renumbered = rows.with_(frame_index=numbers, frames_known=True, detected_in="")
    return renumbered.noted("frame numbers", first=first)


def rows_within(time_range: tuple[float, float], time_s: np.ndarray) -> tuple[int, int]:
    """The first and the last row whose second is in the range, its ends included. InputError when there is none.

    time_s: (T,) increasing.
    """
    start, end = time_range
    first, behind = int(np.searchsorted(time_s, start)), int(np.searchsorted(time_s, end, "right"))
    if first == behind:
        raise InputError(
            "bad-value",
            f"Expected a --time-range that contains frames, got {span_of(start, end)}; the take lasts from "
            f"{span_of(time_s[0], time_s[-1])}.",
        )
    return first, behind - 1


def part_of(sequence: PoseSequence, time_range: tuple[float, float]) -> PoseSequence:
    """What is in the range, by the sequence's own seconds; InputError where nothing is."""
    first, last = rows_within(time_range, sequence.times)
    start, end = time_range
    span = {"from_s": start, "to_s": end if np.isfinite(end) else "end"}
    return sequence.rows(first, last + 1).noted("time range", **span)


def span_of(start: float, end: float) -> str:
    """Seconds in words."""
    return f"{start:.2f} s on" if end == np.inf else f"{start:.2f} to {end:.2f} s"


def open_take(options: RunOptions) -> Take:
    """Read everything and join it. Raises InputError when parts do not fit each other or there is no clock.

    Without poses, frame numbers and clock are those of the keypoints. With a video alone the take has neither poses nor
    keypoints.
    """
    files = _read(options)
    person = track = None
    if files.poses is not None:
        asked_for = options.person if len(files.poses.people) > 1 else None
        person = choose_person(files.poses.people, asked_for, str(files.poses.path))
    if files.keypoints is not None:
        track = _track(files, files.keypoints, options, person)
    names = [rows.person for rows in (person, track) if rows is not None]
    if names and options.person not in (None, *RANKS, *names):
        raise InputError(
            "name-unknown",
            f"There is no person '{options.person}' in these files, only {' and '.join(names)}.",
        )
    return _joined(files, options, person, track)


@dataclass(frozen=True, eq=False)
class Person:
    """One of several people. name: in the file. frames: rows there, or in the part of it that is asked for. take: of
    them, or refusal: why there is none. folder: name of their run's folder."""

    name: str
    frames: int
    take: Take | None = None
    refusal: InputError | None = None
    folder: str = ""


def open_people(options: RunOptions) -> tuple[Person, ...]:
    """A take of each person in the file of poses or, without one, of keypoints; a person who is not
    readable, or seen too briefly, has a reason.

    Keypoints beside poses belong to the person of the same name. Raises InputError when a file cannot be read at all,
    and when the two files name other people, or number them by themselves.
    """
    files = _read(options)
    poses, keypoints = files.poses, files.keypoints
    if options.keypoints_person is not None:
        raise InputError(
            "option-conflict",
            "--set read.keypoints_person names one person, but the run is for all people; leave it out.",
        )
    if poses and keypoints:
        names = [sorted(person.person for person in file.people) for file in (poses, keypoints)]
        if files.nameless or names[0] != names[1]:
            raise InputError(
                "files-apart",
                f"{poses.path} holds the people {', '.join(names[0])} and {keypoints.path} {', '.join(names[1])}, so "
                "it is unclear who is who; leave --keypoints out, or run one --person at a time.",
            )
    tracks = {track.person: track for track in keypoints.people} if keypoints else {}
    people = []
    for person in files.lead.people:
        frames = len(person)
        try:
            take = _joined(files, options, person if poses else None, tracks.get(person.person))
            frames = len(take.rows or ())
            if frames < FEWEST_FRAMES:
                few = f"seen in {how_many(frames, 'frame')}; at least {FEWEST_FRAMES} are needed"
                raise InputError("nothing-usable", few)
            take = take.with_(name=f"{take.name}, person {printable(person.person)}")
            people.append(Person(person.person, frames, take))
        except InputError as error:
            people.append(Person(person.person, frames, refusal=error))
    return tuple(people)


def _read(options: RunOptions) -> Files:
    video = read_video(options.video) if options.video else None
    if video is not None and options.image_size not in (None, size := video.size):
        width, height = options.image_size
        raise InputError(
            "option-conflict",
            f"Expected the image size of keypoints without a video, or that of {options.video}, which shows "
            f"{size[0]}x{size[1]}; got {width}x{height}. Leave out read.image_size, or the video if the keypoints were "
            "detected in a copy of another size.",
        )
    poses, keypoints = (options.in_memory.get(role) for role in ("poses", "keypoints"))
    if options.poses and poses is None:
        poses = load(options.poses, options.adapter, "poses", options.options)
    if options.keypoints and keypoints is None:
        adapter, own = options.keypoints_adapter, options.keypoints_options
        size = options.image_size if video is None else video.size
        keypoints = load(options.keypoints, adapter, "keypoints", own, size)
    if poses is None and keypoints is None:
        if video is None:
            raise InputError(
                "needs-input",
                "Expected a video, 3D poses (--poses FILE) or 2D keypoints (--keypoints FILE), got none.",
            )
        if options.first_frame is not None:
            raise InputError(
                "option-conflict",
                "--set read.first_frame numbers the rows of a file, and there is none; leave it out.",
            )
        if options.fps is None:
            check_times(video.time_s, str(video.path))
    return Files(poses, keypoints, video, options.told, options.first_frame)


def _joined(files: Files, options: RunOptions, person: Rows, track: Rows) -> Take:
    """One person's poses and keypoints on one clock; of a video alone neither. person, track: of their files."""
    video, told = files.video, files.told
    poses = person and files.poses and files.poses.normalised(person, told=told)
    keypoints = track and files.keypoints and files.keypoints.normalised(track)
    doubts, part, misfit = list[Notice](), list[Notice](), None
    if poses or keypoints:
        poses, keypoints, doubts = files.joined(poses, keypoints)
    if poses and keypoints and poses.frame.family == "camera":
        misfit = together(poses, keypoints, files.image_size, told.focal_px)
    if (asked := options.time_range) is not None:
        lead = poses or keypoints
        whole = files.seconds(np.arange(len(video.time_s))) if video else lead.times if lead else None
        assert whole is not None  # for there is a video, or a lead
        first, last = rows_within(asked, whole)
        only = f"Only {span_of(whole[first], whole[last])} was processed, as asked"
        part = [notice("part-only", part=only, whole=span_of(whole[0], whole[-1]))]
        person = person and poses and part_of(person.with_(time_s=poses.times), asked)
        poses, keypoints = (rows and part_of(rows, asked) for rows in (poses, keypoints))
        video = video and replace(video, part=(first, last))
    lead = poses or keypoints
    poses, keypoints, changed = _without_altered(poses, person, keypoints)
    swapped, swaps = swaps_of_take(poses, keypoints)
    unnumbered = lead and not lead.frames_known and (video or (poses and keypoints))
    notices = (
        *part,
        *(video.doubts if video else ()),
        *doubts,
        *(lead.notices if lead else ()),
        *(keypoints.notices if keypoints else ()),
        *([notice("not-stated", weight="warning", what=UNNUMBERED)] if unnumbered else ()),
        *([misfit] if misfit else ()),
        *changed,
        *(_coverage(lead, video) if lead and video else ()),
        *swapped,
    )
    of_people = {"poses": poses, "keypoints": keypoints}
    return Take(
        name=printable((options.video or files.lead.path).stem),
        video=video,
        keypoints=keypoints,
        poses=poses,
        findings=None if poses is None or person is None else findings_of(poses, person.frame.unit, swaps),
        notices=without_doubles(notices),
        inputs=tuple(entry | _whose(of_people.get(entry["role"])) for entry in files.inputs),
        session=options.session,
        told=told,
    )


def _whose(rows: Rows) -> dict[str, Any]:
    """Whom a file's rows show, and what was done to them; of a video nothing."""
    return {"person": rows.person, "history": [asdict(step) for step in rows.history]} if rows else {}


def _coverage(lead: PoseSequence, video: Video) -> list[Notice]:
    """A note when the data end well before the video does, or the part of it that was asked for."""
    begin, end = video.span
    first, last = lead.frame_index[[0, -1]]
    if last >= begin + limit("part-only.share") * (end - begin):
        return []
    part = f"The data cover video frames {first} to {last}"
    return [notice("part-only", part=part, whole=how_many(len(video.time_s), "frame"))]


def _without_altered(poses: Rows, person: Rows, keypoints: Rows) -> tuple[Rows, Rows, list[Notice]]:
    """Poses and keypoints without joints that nobody saw, and what is said of that and of keypoints that were altered;
    of poses the findings tell the latter. person: the poses as the adapter gives them, where lines are straight."""
    said: list[Notice] = []
    if keypoints is not None:
        hidden, notices = altered(keypoints)
        keypoints = without_altered(keypoints, hidden)
        said = [*notices, *alterations(keypoints)]
    if poses is not None and person is not None:
        hidden, notices = altered(person)
        common = [name for name in poses.layout.joints if name in person.layout]
        mask = np.zeros(poses.joints.shape[:2], dtype=bool)
        mask[:, poses.layout.indices(common)] = hidden[:, person.layout.indices(common)]
        poses, said = without_altered(poses, mask), [*said, *notices]
    return poses, keypoints, said


def _track(files: Files, file: Source, options: RunOptions, poses: Rows) -> PoseSequence:
    """The track of a file of keypoints that is named or alone, or as long as the poses where these have no numbers."""
    where = str(file.path)
    tracks = file.people if poses is not None else _tracks(files, file, options)
    person = options.person if len(tracks) > 1 else None
    if options.keypoints_person is not None:
        return choose_person(tracks, options.keypoints_person, where)
    if poses is None:
        own = file.adapter == "keypoints"  # as the run that detected them
        return (choose_detected if own else choose_person)(tracks, person, where)
    if options.person is None and len(tracks) > 1 and not poses.frames_known:
        fitting = [track for track in tracks if len(track) == len(poses)]
        if len(fitting) == 1:
            return fitting[0]
        if sum(map(len, tracks)) == len(poses):
            raise InputError(
                "people-mixed",
                f"{options.poses} has {how_many(len(poses), 'row')}, as many as all {len(tracks)} people of "
                f"{file.path} together: the lifter took them for one (MotionBERT without --focus); lift one at a time.",
            )
    if files.poses and len(files.poses.people) > 1 and len(tracks) > 1:
        if files.nameless:
            raise InputError(
                "choose-person",
                f"Nothing says which track of {where} is person '{poses.person}' of {options.poses}, for the people of "
                f"both are numbered by themselves: it holds {listed_people(tracks)}; choose one with --set "
                "read.keypoints_person=NAME, or leave --keypoints out.",
            )
        # A rank means metres in one file and pixels in the other, so the poses' choice holds for both.
        person = poses.person if person in RANKS else person
    return choose_person(tracks, person, where)


def _tracks(files: Files, file: Source, options: RunOptions) -> tuple[PoseSequence, ...]:
    """The tracks of a file of keypoints; those of one person as one where a video's images show it, and nobody is asked
    for by a name of the file."""
    video = files.video
    asked_for = options.keypoints_person or options.person
    if video is None or options.first_frame is not None or asked_for not in (None, *RANKS):
        return file.people
    within = all(track.frames_known and track.frame_index[-1] < len(video.time_s) for track in file.people)
    return rejoined(file.people, video) if within else file.people
