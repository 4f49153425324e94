"""Files become a take: video, keypoints and poses read, joined frame by frame, and put on one clock."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..core.errors import InputError
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
from .join import Files, Rows, coverage, part_of, rows_within, span_of
from .load import Source, load, read_video
from .settings import RunOptions
from .together import together


def open_take(options: RunOptions) -> Take:
    """Read everything and join it. Raises InputError when parts do not fit each other or there is no clock.

    Without poses, frame numbers and clock are those of the keypoints. With a video alone the take has neither poses nor
    keypoints.
    """
    files = _read(options)
    poses = keypoints = None
    if files.poses is not None:
        person = options.person if len(files.poses.people) > 1 else None
        chosen = choose_person(files.poses.people, person, str(files.poses.path))
        poses = files.poses.normalised(chosen, told=options.told)
    if files.keypoints is not None:
        keypoints = files.keypoints.normalised(_track(files, files.keypoints, poses))
    names = [rows.person for rows in (poses, keypoints) if rows is not None]
    if names and options.person not in (None, *RANKS, *names):
        raise InputError(
            "name-unknown",
            f"There is no person '{options.person}' in these files, only {' and '.join(names)}.",
        )
    return _joined(files, poses, keypoints)


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
            body = poses.normalised(person, told=options.told) if poses else None
            track = keypoints.normalised(tracks[person.person]) if keypoints else None
            take = _joined(files, body, track)
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
    return Files(poses, keypoints, video, options)


def _joined(files: Files, poses: Rows, keypoints: Rows) -> Take:
    """One person's poses and keypoints on one clock; of a video alone neither."""
    options, video = files.options, files.video
    doubts, part = list[Notice](), list[Notice]()
    if poses or keypoints:
        poses, keypoints, doubts = files.joined(poses, keypoints)
    strange = _misfit(files, poses, keypoints)
    source = (
        files.poses and poses and next(each for each in files.poses.people if each.person == poses.person)
    )
    if (asked := options.time_range) is not None:
        lead = poses or keypoints
        whole = files.video_seconds if lead is None or video is not None else lead.times
        first, last = rows_within(asked, whole)
        only = f"Only {span_of(whole[first], whole[last])} was processed, as asked"
        part = [notice("part-only", part=only, whole=span_of(whole[0], whole[-1]))]
        source = source and poses and part_of(source.with_(time_s=poses.times), asked)
        poses, keypoints = (rows and part_of(rows, asked) for rows in (poses, keypoints))
        video = video and replace(video, part=(first, last))
    lead = poses or keypoints
    poses, keypoints, changed = _without_altered(poses, source, keypoints)
    poses, keypoints, swapped, swaps = treated(poses, keypoints, options.swaps)
    notices = (
        *part,
        *(video.doubts if video else ()),
        *doubts,
        *_doubts(lead, keypoints, video),
        *strange,
        *changed,
        *coverage(lead, video),
        *swapped,
    )
    return Take(
        name=printable((options.video or files.lead.path).stem),
        video=video,
        keypoints=keypoints,
        poses=poses,
        findings=None if poses is None else findings_of(poses, source, swaps),
        notices=without_doubles(notices),
        inputs=_provenance(files, poses=poses, keypoints=keypoints),
        session=options.session,
        told=options.told,
    )


def _misfit(files: Files, poses: Rows, keypoints: Rows) -> list[Notice]:
    """A notice where the keypoints show somebody else than the poses, or other frames."""
    if poses is None or keypoints is None or poses.frame.family != "camera":
        return []
    fit = together(poses, keypoints, files.image_size, files.options.focal)
    misfit = fit and fit.notice()
    return [misfit] if misfit else []


def _provenance(files: Files, **people: Rows) -> tuple[dict[str, Any], ...]:
    """The files, and of those of people whom it is and what was done to them."""
    return tuple(
        entry | {"person": rows.person, "history": [asdict(step) for step in rows.history]}
        if (rows := people.get(entry["role"]))
        else entry
        for entry in files.inputs
    )


def _without_altered(poses: Rows, source: Rows, keypoints: Rows) -> tuple[Rows, Rows, list[Notice]]:
    """Poses and keypoints without joints that nobody saw, and what is said of that and of keypoints that were altered;
    of poses the findings tell the latter. source: the poses as the adapter gives them, where lines are straight."""
    said: list[Notice] = []
    if keypoints is not None:
        hidden, notices = altered(keypoints)
        keypoints = without_altered(keypoints, hidden)
        said = [*notices, *alterations(keypoints)]
    if poses is not None and source is not None and len(source) == len(poses):
        hidden, notices = altered(source)
        mask = np.zeros(poses.joints.shape[:2], dtype=bool)
        for joint, name in enumerate(poses.layout.joints):
            if name in source.layout:
                mask[:, joint] = hidden[:, source.layout.index(name)]
        poses, said = without_altered(poses, mask), [*said, *notices]
    return poses, keypoints, said


def _track(files: Files, file: Source, poses: Rows) -> PoseSequence:
    """The track of a file of keypoints that is named or alone, or as long as the poses where these have no numbers."""
    options, where = files.options, str(file.path)
    tracks = file.people if poses is not None else _tracks(files, file)
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


def _tracks(files: Files, file: Source) -> tuple[PoseSequence, ...]:
    """The tracks of a file of keypoints; those of one person as one where a video's images show it, and nobody is asked
    for by a name of the file."""
    video, options = files.video, files.options
    asked_for = options.keypoints_person or options.person
    if video is None or options.first_frame is not None or asked_for not in (None, *RANKS):
        return file.people
    within = all(track.frames_known and track.frame_index[-1] < len(video.time_s) for track in file.people)
    return rejoined(file.people, video) if within else file.people


def _doubts(lead: Rows, keypoints: Rows, video: Video | None) -> list[Notice]:
    """Warnings about data that should not be believed as they are. keypoints: the lead, or those beside it."""
    said = [each for rows in (lead, keypoints) if rows for each in rows.notices]
    beside = video is not None or (keypoints is not None and keypoints is not lead)
    if lead is not None and beside and not lead.frames_known:
        said.append(notice("not-stated", weight="warning", what=UNNUMBERED))
    return said
