"""Which frames of one file are those of another, and at which second each was taken: poses, keypoints and video of one
recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.messages import how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Video
from ..signals.filters import nearest_row, rate
from .bounds import check_fps, check_times, rate_doubts
from .load import Source

_WHOLE = 0.95  # of a video's frames, up to the last that rows show
_OTHER_RATE = 1.05  # times as many frames a second; 33 ms a frame, as rounded times say, are 29.97 a second


@dataclass(frozen=True, eq=False)
class Join:
    """The files of one recording, with everybody in them, and what the user says of their frames: fps, frames a second,
    and first_frame, the video frame of the first row."""

    poses: Source | None
    keypoints: Source | None
    video: Video | None
    fps: float | None
    first_frame: int | None

    @property
    def lead(self) -> Source:
        """Whose people, frame numbers and clock count: the poses', or without poses the keypoints'."""
        lead = self.poses or self.keypoints
        if lead is None:
            raise InputError(
                "needs-input",
                "Expected a file of several people (--poses or --keypoints), got a video alone.",
            )
        return lead

    def joined(
        self, poses: PoseSequence | None, keypoints: PoseSequence | None
    ) -> tuple[PoseSequence | None, PoseSequence | None, list[Notice]]:
        """One person's, with numbers of video frames and seconds, and what is doubtful of the rate. InputError where
        the files do not go together, or nothing tells which frames the rows are, or when they were taken."""
        path = self.lead.path
        by_poses = poses is None or poses.frames_known or self.keypoints is None
        numbers_rows = self.lead if by_poses else self.keypoints
        assert numbers_rows is not None
        lowest = min(int(person.frame_index[0]) for person in numbers_rows.people)
        poses, keypoints = self.numbered(poses, keypoints)
        lead = keypoints if poses is None else poses
        assert lead is not None
        self._check_numbers(lead, path, lowest)
        other = keypoints if lead.time_s is None else lead
        doubts = self._doubts(other)
        lead = lead.with_(time_s=self._seconds(lead.frame_index, path, other))
        by_video = self.video is not None and self.fps is None
        check_times(lead.times, str(self.video.path if by_video and self.video else path))
        if poses is None:
            return None, lead, doubts
        if keypoints is not None and self.keypoints is not None:
            other = lead if keypoints.time_s is None else keypoints
            time_s = self._seconds(keypoints.frame_index, self.keypoints.path, other)
            keypoints = keypoints.with_(time_s=time_s)
        return lead, keypoints, doubts

    def numbered(
        self, poses: PoseSequence | None, keypoints: PoseSequence | None
    ) -> tuple[PoseSequence | None, PoseSequence | None]:
        """Both with the numbers of their video frames, as far as the files and `first_frame` tell."""
        first, numbering = self.first_frame, self.lead
        if poses is not None and keypoints is None and self.video and first is None:
            poses = numbered_by_times(self.video, poses)
        if poses is not None and not poses.frames_known:
            if self.keypoints and keypoints and (first is None or len(poses) == len(keypoints)):
                numbering = self.keypoints  # the rows of the one are those of the other
            elif first is not None:
                poses = _starting_at(int(poses.frame_index[0]) + first, poses)
                first = None  # done, for keypoints beside them have numbers of their own
        if poses is not None and keypoints is not None and self.poses and self.keypoints:
            poses = numbered_by(keypoints, poses, f"{self.poses.path} and {self.keypoints.path}")
        if first is None:
            return poses, keypoints
        # One shift for everybody in the file; rows without numbers are counted from 0, whoever is seen in the first.
        shift = first - min(
            int(person.frame_index[0]) if person.frames_known else 0 for person in numbering.people
        )
        poses, keypoints = (
            rows and _starting_at(int(rows.frame_index[0]) + shift, rows) for rows in (poses, keypoints)
        )
        return poses, keypoints

    def video_seconds(self) -> np.ndarray:
        """(N,) seconds of all frames of the video."""
        assert self.video is not None
        return self._seconds(np.arange(len(self.video.time_s)), self.video.path)

    def _check_numbers(self, sequence: PoseSequence, path: Path, lowest: int) -> None:
        """InputError when nothing says which of the video's frames the rows are, or there are no such frames. lowest:
        number in the file that numbers the rows."""
        video, first = self.video, lowest if self.first_frame is None else None
        if video is None:
            return
        frames = len(video.time_s)
        if not sequence.frames_known and len(sequence) != frames:
            raise InputError(
                "needs-input",
                f"{path} has {how_many(len(sequence), 'row')} without frame numbers, the video "
                f"{how_many(frames, 'frame')}; give the "
                "2D file that the lifter was run on (--keypoints), or --set read.first_frame=N if the "
                "rows are consecutive.",
            )
        if (last := int(sequence.frame_index[-1])) < frames:
            return
        if first is None:
            way_out = ", or its first row is another frame (--set read.first_frame=N)"
        elif first and last == frames:  # the first images may show nobody, so the lowest number need not be 1
            way_out = (
                f", unless its numbers count from 1: then pass --set read.first_frame={first - 1}, the video frame of "
                f"the lowest number, {first}"
            )
        elif first:
            way_out = (
                f", unless its lowest number, {first}, is video frame N: then pass --set read.first_frame=N"
            )
        else:
            way_out = ""
        raise InputError(
            "files-apart",
            f"{path}, or the 2D file that numbers its rows, reaches video frame {last}, but {video.path} ends with "
            f"frame {frames - 1}; they do not belong together{way_out}.",
        )

    def _seconds(self, frames: np.ndarray, path: Path, other: PoseSequence | None = None) -> np.ndarray:
        """(T,) seconds of these frames of the file at `path`: by the given rate, else by the video's own stamps, else
        by those of another sequence. InputError when nothing tells the time."""
        if self.video is not None and frames[-1] >= len(self.video.time_s):
            raise InputError(
                "files-apart",
                f"{path} reaches video frame {frames[-1]}, but {self.video.path} ends with frame "
                f"{len(self.video.time_s) - 1}; they do not belong together.",
            )
        if self.fps is not None:
            return frames / check_fps(self.fps)
        if self.video is not None:
            return self.video.time_s[frames]
        if other is None or other.time_s is None:
            if len(frames) == 1:  # an image has no rate
                return np.zeros(1)
            raise InputError(
                "needs-rate",
                f"Nothing says at which rate {path} was recorded: give --fps F, or the video itself.",
            )
        if len(other) == 1:
            return other.times + (frames - other.frame_index[0])
        between = np.interp(frames, other.frame_index, other.times)
        first, last = other.frame_index[[0, -1]]
        outside = np.clip(frames - last, 0, None) + np.clip(frames - first, None, 0)
        return between + outside / other.fps

    def _doubts(self, other: PoseSequence | None) -> list[Notice]:
        """Notices where the rate contradicts the video's or, without one, the other sequence's; and where these two
        contradict each other."""
        timed = other is not None and other.time_s is not None and len(other) > 1
        stated = other.fps if timed and other else None
        doubts = rate_doubts(self.fps, self.video, stated)
        if doubts or self.fps is not None or self.video is None or other is None or stated is None:
            return doubts
        first, last = other.frame_index[[0, -1]]
        if last >= len(self.video.time_s):  # refused as soon as its seconds are asked for
            return []
        start_s, stop_s = self.video.time_s[[first, last]]
        shown = float((last - first) / (stop_s - start_s))  # of the same frames
        # A file that counts frames at the one rate of a video whose images come unevenly contradicts no more than that.
        if any(
            1 / _OTHER_RATE < stated / of < _OTHER_RATE
            for of in (shown, self.video.fps, rate(self.video.time_s))
        ):
            return []
        return [notice("clocks-contradict", shown_fps=shown, stated_fps=stated, times=shown / stated)]


def numbered_by(keypoints: PoseSequence, poses: PoseSequence, where: str) -> PoseSequence:
    """The poses with the 2D file's frame numbers where they have none of their own. InputError if they cannot be."""
    if poses.frames_known:
        if not np.isin(poses.frame_index, keypoints.frame_index).any():
            raise InputError("files-apart", f"{where} have no video frame in common.")
        return poses
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
    """The poses with the numbers of the video's frames at their own times, where they have times and no numbers, each
    is within half an interval of one frame, and they last about as long as the video: a part's own clock may begin
    anew. A phone's video lacks images, which numbers counted by times would count."""
    if poses.frames_known or poses.time_s is None or len(video.time_s) < 2:
        return poses
    numbers = nearest_row(video.time_s, poses.time_s)
    off = np.abs(video.time_s[numbers] - poses.time_s)
    whole = numbers[-1] >= _WHOLE * (len(video.time_s) - 1)
    if not whole or (off >= np.median(np.diff(video.time_s)) / 2).any() or (np.diff(numbers) <= 0).any():
        return poses
    return poses.with_(frame_index=numbers, frames_known=True).noted("frame numbers", source="times")


def _starting_at(first_frame: int, sequence: PoseSequence) -> PoseSequence:
    """The sequence with its first row at that video frame and the others as far from it as they were.
    InputError for a negative frame."""
    if first_frame < 0:
        raise InputError("bad-value", f"Expected the first row at video frame 0 or later, got {first_frame}.")
    numbers = sequence.frame_index - sequence.frame_index[0] + first_frame
    renumbered = sequence.with_(frame_index=numbers, frames_known=True, detected_in="")
    return renumbered.noted("frame numbers", first=first_frame)


def rows_within(time_range: tuple[float, float], time_s: np.ndarray) -> tuple[int, int]:
    """The first and the last row whose second is in the range, its ends included. InputError when there is none.

    time_s: (T,) increasing.
    """
    start, end = time_range
    first, behind = int(np.searchsorted(time_s, start)), int(np.searchsorted(time_s, end, "right"))
    if first == behind:
        raise InputError(
            "bad-value",
            f"Expected a --time-range that contains frames, got {_span(start, end)}; the take lasts from "
            f"{_span(time_s[0], time_s[-1])}.",
        )
    return first, behind - 1


def range_note(time_range: tuple[float, float], time_s: np.ndarray) -> Notice:
    """That only a part was read. time_s: (T,) of the whole."""
    first, last = rows_within(time_range, time_s)
    part, whole = _span(time_s[first], time_s[last]), _span(time_s[0], time_s[-1])
    return notice("part-only", part=f"Only {part} was processed, as asked", whole=whole)


def part_of(sequence: PoseSequence, time_range: tuple[float, float]) -> PoseSequence:
    """What is in the range, by the sequence's own seconds; InputError where nothing is."""
    first, last = rows_within(time_range, sequence.times)
    start, end = time_range
    span = {"from_s": start, "to_s": end if np.isfinite(end) else "end"}
    return sequence.rows(first, last + 1).noted("time range", **span)


def coverage(lead: PoseSequence, video: Video | None) -> list[Notice]:
    """A note when the data end well before the video does, or the part of it that was asked for."""
    if video is None:
        return []
    begin, end = video.span
    first, last = lead.frame_index[[0, -1]]
    if last >= begin + 0.95 * (end - begin):
        return []
    part = f"The data cover video frames {first} to {last}"
    return [notice("part-only", part=part, whole=how_many(len(video.time_s), "frame"))]


def _span(start: float, end: float) -> str:
    return f"{start:.2f} s on" if end == np.inf else f"{start:.2f} to {end:.2f} s"
