"""Files become a take: video, keypoints and poses read, joined frame by frame, and put on one clock."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.messages import how_many
from ..core.notices import Notice, notice, without_doubles
from ..core.pose import PoseSequence
from ..core.take import Take, Video
from ..files.atomic import printable
from ..files.detections import FEWEST_FRAMES
from ..signals.altered import alterations, altered, without_altered
from .again import rejoined
from .bounds import check_times
from .choose import RANKS, choose_detected, choose_person, listed_people
from .exchanged import treated
from .findings import UNNUMBERED, findings_of
from .join import Files, Rows, part_of, rows_within, span_of
from .load import Source, load, read_video
from .settings import RunOptions
from .together import together


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
    poses, keypoints, swapped, swaps = treated(poses, keypoints, told.swaps)
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
