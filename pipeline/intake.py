"""Files become a take: video, keypoints and poses read, joined frame by frame, and put on one clock."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from .checks import implausible
from .errors import InputError
from .joining import Clock, check_numbers, numbered_by, starting_at
from .options import call
from .outputs import printable
from .pose import PoseSequence
from .reading import Missing, Parity, choose_person, find_adapter, read_people
from .take import Event, Take, Video


@dataclass(frozen=True)
class Sources:
    """What a user gave: files and how to read them. Poses, or keypoints that are to be lifted, or a video alone.

    options, keypoints_options: the adapters' own. first_frame: the video frame of the first row; the
    others keep their distance to it. fps: frame rate; without it the video's time stamps count.
    """

    poses: Path | None = None
    video: Path | None = None
    keypoints: Path | None = None
    adapter: str = "auto"
    keypoints_adapter: str = "auto"
    person: str | None = None
    fps: float | None = None
    first_frame: int | None = None
    parity: Parity = "refuse"
    missing: Missing = "refuse"
    options: dict[str, Any] = field(default_factory=dict)
    keypoints_options: dict[str, Any] = field(default_factory=dict)


def open_take(sources: Sources) -> Take:
    """Read everything and join it. Raises InputError when parts do not fit each other or there is no clock.

    Without poses the keypoints lead: theirs are the frame numbers and the clock. Of a video alone the take has neither.
    """
    video = read_video(sources.video) if sources.video else None
    poses = _poses(sources)
    keypoints = _keypoints(sources, poses)
    _check_person(sources.person, poses, keypoints)
    if poses is not None and sources.first_frame is not None and not poses.frames_known:
        poses = starting_at(sources.first_frame, poses)
    if poses is not None and keypoints is not None:
        poses = numbered_by(keypoints, poses, f"{sources.poses} and {sources.keypoints}")
    lead, path = (keypoints, sources.keypoints) if poses is None else (poses, sources.poses)
    if lead is None or path is None:
        return _video_alone(sources, video)
    if sources.first_frame is not None:
        shift = sources.first_frame - int(lead.frame_index[0])
        lead = starting_at(sources.first_frame, lead)
        if poses is not None and keypoints is not None and shift:
            keypoints = starting_at(int(keypoints.frame_index[0]) + shift, keypoints)
    check_numbers(lead, video, path)
    clock = Clock(video, sources.fps, keypoints if lead.time_s is None else lead)
    lead = lead.with_(time_s=clock.seconds(lead.frame_index, path))
    if poses is None:
        keypoints = lead
    elif keypoints is not None and sources.keypoints:
        clock = replace(clock, other=lead if keypoints.time_s is None else keypoints)
        keypoints = keypoints.with_(time_s=clock.seconds(keypoints.frame_index, sources.keypoints))
    poses = None if poses is None else lead
    return Take(
        name=printable((sources.video or path).stem),
        video=video,
        keypoints=keypoints,
        poses=poses,
        events=(
            *_repairs(lead),
            *(Event("warning", text) for text in (*clock.doubts(), *_doubts(lead))),
            *_coverage(lead, video),
        ),
        inputs=_provenance(sources, poses, keypoints),
    )


def _video_alone(sources: Sources, video: Video | None) -> Take:
    """The take of a video in which the person is still to be found."""
    if video is None:
        raise InputError(
            "Expected a video, 3D poses (--poses FILE) or 2D keypoints (--keypoints FILE), got none."
        )
    if sources.first_frame is not None:
        raise InputError("--first-frame numbers the rows of a file, and there is none; leave it out.")
    return Take(name=printable(video.path.stem), video=video, inputs=_provenance(sources, None, None))


def _check_person(person: str | None, *found: PoseSequence | None) -> None:
    """InputError when the person that was asked for is neither of those that were found."""
    names = [poses.person for poses in found if poses is not None]
    if person not in (None, "longest", *names):
        raise InputError(f"There is no person '{person}' in these files; found {' and '.join(names)}.")


def _poses(sources: Sources) -> PoseSequence | None:
    """The person's 3D poses, when there is a file of them."""
    if sources.poses is None:
        return None
    people = read_people(
        sources.poses, sources.adapter, "poses", None, sources.parity, sources.missing, sources.options
    )
    return choose_person(people, sources.person if len(people) > 1 else None, str(sources.poses))


def _keypoints(sources: Sources, poses: PoseSequence | None) -> PoseSequence | None:
    """The person's 2D keypoints, when there is a file of them: the track that is named, alone, or fits the poses."""
    if sources.keypoints is None:
        return None
    where = str(sources.keypoints)
    tracks = read_people(
        sources.keypoints,
        sources.keypoints_adapter,
        "keypoints",
        None,
        "refuse",
        "refuse",
        sources.keypoints_options,
    )
    if sources.person is None and len(tracks) > 1 and poses is not None and not poses.frames_known:
        fitting = [track for track in tracks if len(track) == len(poses)]
        if len(fitting) == 1:
            return fitting[0]
        if sum(map(len, tracks)) == len(poses):
            raise InputError(
                f"{sources.poses} has {len(poses)} rows, as many as all {len(tracks)} people of {where} together: the "
                "lifter took several people for one (MotionBERT without --focus); lift one person at a time."
            )
    return choose_person(tracks, sources.person if len(tracks) > 1 else None, where)


def read_video(path: Path) -> Video:
    """The video's description; InputError when it cannot be opened."""
    if not path.is_file():
        raise InputError(
            f"Expected a video file at {path}, found {'a folder' if path.is_dir() else 'nothing'} there."
        )
    adapter = find_adapter(path, "video", "video")
    return call(adapter.read, path, what="Adapter 'video'", options={})[0]


def _repairs(lead: PoseSequence) -> list[Event]:
    """What was mended while reading because the user asked for it."""
    events = []
    for step in lead.history:
        if step.name == "parity" and step.options.get("repair") not in (None, "ignore"):
            events.append(
                Event("repair", f"Left and right were put right as asked: {step.options['repair']}.")
            )
        if step.name == "missing":
            counts = ", ".join(f"{count} {what}" for what, count in step.options.items() if count)
            events.append(Event("repair", f"Taken for gaps as asked: {counts}."))
    return events


def _coverage(lead: PoseSequence, video: Video | None) -> list[Event]:
    """A note when the data end well before the video does."""
    if video is None or lead.frame_index[-1] >= 0.95 * (len(video.time_s) - 1):
        return []
    first, last = lead.frame_index[[0, -1]]
    return [Event("note", f"The data cover video frames {first} to {last} of {len(video.time_s)}.")]


def _doubts(lead: PoseSequence) -> list[str]:
    """Warnings about data that were read but should not be believed as they are."""
    warnings = [str(step.options["warning"]) for step in lead.history if "warning" in step.options]
    if lead.frame.dims == 3:
        warnings += implausible(lead)
    if not lead.frames_known:
        warnings.append(
            "Nothing says which video frames the rows are; they are taken for consecutive ones from 0."
        )
    return warnings


def _provenance(
    sources: Sources, poses: PoseSequence | None, keypoints: PoseSequence | None
) -> tuple[dict[str, Any], ...]:
    read = {
        "poses": (sources.poses, poses),
        "keypoints": (sources.keypoints, keypoints),
        "video": (sources.video, None),
    }
    return tuple(
        {
            "role": role,
            "file": printable(path.name),
            "sha256": sha256(path),
            **(_reading(sequence) if sequence else {"adapter": "video"}),
        }
        for role, (path, sequence) in read.items()
        if path is not None
    )


def _reading(sequence: PoseSequence) -> dict[str, Any]:
    steps = [asdict(step) for step in sequence.history]
    return {"adapter": sequence.history[0].options["adapter"], "person": sequence.person, "history": steps}


def sha256(path: Path) -> str:
    """SHA-256 of a file, or of a folder's relative names and contents in sorted order."""
    if path.is_file():
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    digest = hashlib.sha256()
    for part in sorted(p for p in path.rglob("*") if p.is_file()):
        digest.update(f"{part.relative_to(path)}\0{sha256(part)}\n".encode())
    return digest.hexdigest()
