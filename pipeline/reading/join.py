"""Which frames of one file are those of another, and at which second each was taken: poses, keypoints and video of one
recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.messages import how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Told, Video
from ..files.atomic import printable
from ..files.digest import sha256
from ..signals.filters import nearest_row, rate
from .bounds import check_fps, check_times, image_size_doubts, rate_doubts
from .load import Source

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
