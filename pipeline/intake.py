"""Files become a take: video, keypoints and poses read, joined frame by frame, and put on one clock."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .checks import bone_spread
from .errors import InputError
from .options import call
from .pose import PoseSequence
from .reading import Missing, Parity, choose_person, find_adapter, read_all
from .take import Event, Take, Video

_UNSTEADY = 0.12  # bone-length spread beyond which poses are not to be believed (boxing 0.05, cycling 0.10)
_FPS_TOLERANCE = 0.01


@dataclass(frozen=True)
class Sources:
    """What a user gave: files and how to read them.

    options, keypoints_options: the adapters' own. first_frame: the video frame of the poses' first row, for
    files that do not know it. fps: frame rate; without it the video's time stamps count.
    """

    poses: Path
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
    """Read everything and join it. Raises InputError when parts do not fit each other or there is no clock."""
    video = read_video(sources.video) if sources.video else None
    people = read_all(
        sources.poses,
        sources.adapter,
        gives="poses",
        parity=sources.parity,
        missing=sources.missing,
        **sources.options,
    )
    poses = choose_person(people, sources.person if len(people) > 1 else None, str(sources.poses))
    keypoints, events = None, []
    if sources.keypoints:
        tracks = read_all(
            sources.keypoints, sources.keypoints_adapter, gives="keypoints", **sources.keypoints_options
        )
        keypoints = _track_of(poses, tracks, sources)
        poses = _numbered_by(keypoints, poses, sources)
    poses = _numbered(poses, video, sources)
    poses, clock_events = _timed(poses, video, sources, keypoints)
    if keypoints is not None and keypoints.time_s is None:
        keypoints = keypoints.with_(time_s=_clock(keypoints.frame_index, video, sources, poses))
    events += clock_events + _doubts(poses)
    return Take(
        name=(sources.video or sources.poses).stem,
        video=video,
        keypoints=keypoints,
        poses=poses,
        events=tuple(events),
        inputs=_provenance(sources, poses, keypoints),
    )


def read_video(path: Path) -> Video:
    """The video's description; InputError when it cannot be opened."""
    if not path.is_file():
        raise InputError(
            f"Expected a video file at {path}, found {'a folder' if path.is_dir() else 'nothing'} there."
        )
    adapter = find_adapter(path, "video", "video")
    return call(adapter.read, path, what="Adapter 'video'", options={})[0]


def _track_of(poses: PoseSequence, tracks: tuple[PoseSequence, ...], sources: Sources) -> PoseSequence:
    """The 2D track of the person in the poses: the named one, the only one, or the only one that fits."""
    where = str(sources.keypoints)
    if sources.person is not None or len(tracks) == 1:
        return choose_person(tracks, sources.person if len(tracks) > 1 else None, where)
    if not poses.frames_known:
        fitting = [track for track in tracks if len(track) == len(poses)]
        if len(fitting) == 1:
            return fitting[0]
        if sum(map(len, tracks)) == len(poses):
            raise InputError(
                f"{sources.poses} has {len(poses)} rows, as many as all {len(tracks)} people of {where} together: the "
                "lifter took several people for one (MotionBERT without --focus); lift one person at a time."
            )
    return choose_person(tracks, None, where)


def _numbered_by(keypoints: PoseSequence, poses: PoseSequence, sources: Sources) -> PoseSequence:
    """The poses with the 2D file's frame numbers where they have none of their own."""
    if poses.frames_known:
        if not np.isin(poses.frame_index, keypoints.frame_index).any():
            raise InputError(f"{sources.poses} and {sources.keypoints} have no video frame in common.")
        return poses
    if len(poses) != len(keypoints):
        raise InputError(
            f"{sources.poses} has {len(poses)} rows and {sources.keypoints} {len(keypoints)}, and the poses carry no "
            "frame numbers to join them by; give the 2D file that the lifter was run on, or leave --keypoints out."
        )
    return poses.with_(frame_index=keypoints.frame_index, frames_known=keypoints.frames_known).noted(
        "frame numbers", source="keypoints"
    )


def _numbered(poses: PoseSequence, video: Video | None, sources: Sources) -> PoseSequence:
    """The poses with numbers of the video's frames; InputError when nothing says which frames they are."""
    if sources.first_frame is not None:
        if poses.frames_known:
            raise InputError("--first-frame is for poses without frame numbers; these have their own.")
        if sources.first_frame < 0:
            raise InputError(f"Expected --first-frame 0 or more, got {sources.first_frame}.")
        numbers = np.arange(len(poses)) + sources.first_frame
        poses = poses.with_(frame_index=numbers, frames_known=True).noted(
            "frame numbers", first=sources.first_frame
        )
    if video is None:
        return poses
    frames = len(video.time_s)
    if not poses.frames_known and len(poses) != frames:
        raise InputError(
            f"{sources.poses} has {len(poses)} rows without frame numbers, the video {frames} frames; give the 2D file "
            "that the lifter was run on (--keypoints), or --first-frame N if the rows are consecutive."
        )
    if poses.frame_index[-1] >= frames:
        raise InputError(
            f"The poses reach video frame {poses.frame_index[-1]}, but {sources.video} ends with frame {frames - 1}; "
            "they do not belong together."
        )
    return poses


def _timed(
    poses: PoseSequence, video: Video | None, sources: Sources, keypoints: PoseSequence | None
) -> tuple[PoseSequence, list[Event]]:
    events = []
    if video is not None and sources.fps and abs(sources.fps / video.fps - 1) > _FPS_TOLERANCE:
        events.append(
            Event(
                "warning",
                f"--fps {sources.fps:g} is used although the video says {video.fps:g} frames per second.",
            )
        )
    if video is None and sources.fps is None:
        if poses.time_s is not None:
            return poses, events
        if keypoints is None or keypoints.time_s is None:
            raise InputError(
                f"Nothing says at which rate {sources.poses} was recorded: give --fps F, or the video itself."
            )
        times = np.interp(poses.frame_index, keypoints.frame_index, keypoints.times)
        return poses.with_(time_s=times), events
    return poses.with_(time_s=_clock(poses.frame_index, video, sources, poses)), events


def _clock(frames: np.ndarray, video: Video | None, sources: Sources, poses: PoseSequence) -> np.ndarray:
    """Seconds of video frames: by the given rate, else the video's stamps, else the poses' own."""
    if sources.fps is not None:
        if not 0 < sources.fps < 10_000:
            raise InputError(f"Expected --fps in frames per second, got {sources.fps:g}.")
        return frames / sources.fps
    if video is not None:
        if frames[-1] >= len(video.time_s):
            raise InputError(
                f"{sources.keypoints} reaches frame {frames[-1]}, but {sources.video} ends with frame "
                f"{len(video.time_s) - 1}; they do not belong together."
            )
        return video.time_s[frames]
    step = 1 / poses.fps if len(poses) > 1 else 1.0
    return poses.times[0] + (frames - poses.frame_index[0]) * step


def _doubts(poses: PoseSequence) -> list[Event]:
    """Warnings about poses that were read but should not be believed as they are."""
    warnings = [str(step.options["warning"]) for step in poses.history if "warning" in step.options]
    spread = bone_spread(poses)
    if spread > _UNSTEADY:
        warnings.append(
            f"THESE POSES ARE NOT GOOD DATA: bone lengths vary by {100 * spread:.0f} % after each frame's own size is "
            "taken out (5 % is usual, 9 % poor); every result below inherits that."
        )
    if not poses.frames_known:
        warnings.append(
            "Nothing says which video frames the rows are; they are taken for consecutive ones from 0."
        )
    return [Event("warning", text) for text in warnings]


def _provenance(
    sources: Sources, poses: PoseSequence, keypoints: PoseSequence | None
) -> tuple[dict[str, Any], ...]:
    read = {
        "poses": (sources.poses, poses),
        "keypoints": (sources.keypoints, keypoints),
        "video": (sources.video, None),
    }
    return tuple(
        {
            "role": role,
            "file": path.name,
            "sha256": sha256(path),
            "adapter": sequence.history[0].options["adapter"] if sequence else "video",
        }
        for role, (path, sequence) in read.items()
        if path is not None
    )


def sha256(path: Path) -> str:
    """SHA-256 of a file, or of a folder's relative names and contents in sorted order."""
    if path.is_file():
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    digest = hashlib.sha256()
    for part in sorted(p for p in path.rglob("*") if p.is_file()):
        digest.update(f"{part.relative_to(path)}\0{sha256(part)}\n".encode())
    return digest.hexdigest()
