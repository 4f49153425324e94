"""The recording: everything about a take on one time axis, in one file for the rerun viewer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...pipeline.core.frames import BODY
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.system import give_memory_back
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import require_space, whole_file
from ...pipeline.files.names import RECORDING
from ..drawing.facts import provenance
from ..drawing.palette import MIDDLE, PURPLE
from ..drawing.rerun_file import recording_file
from ..drawing.rerun_log import (
    half_height,
    log_curves,
    log_notices,
    log_skeleton,
    log_video,
    person_view,
)
from ..drawing.rerun_video import on_clock, viewable
from .angles import angle_views, first_angles, log_angles, log_marks
from .room import first_view, log_room, walk_view, walked

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_FRAME_BYTES, _FIXED_BYTES = 2048, 1 << 20  # of a recording without its video; 10,000 frames take 17 MB
# Where the eye stands, in sizes of the person from the pelvis and in the reference axes of a frame's family.
_EYES = {
    "camera": (0.5, -0.4, -2.4),  # near the camera itself
    "world": (-2.2, 1.1, 0.5),
    "body": (-2.2, 1.1, 0.5),  # in front of the person, who faces -x, to the right and a little above
}


@dataclass(frozen=True)
class Record:
    """The stage. folder: where take.rrd goes."""

    folder: Path

    name: ClassVar[str] = "record"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified")
    gives: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]] = ("images",)

    def __call__(self, take: Take) -> Take:
        self.folder.mkdir(parents=True, exist_ok=True)
        record(take, self.folder / RECORDING)
        return take


def record(take: Take, path: str | Path) -> None:
    """Write a take into one rerun recording that opens with its own views.

    Time axes: "frame", the number of the video's frame, and "video_time", its time stamp in seconds.
    Entities: video (which frame of which of video_parts), video/keypoints; source (the skeleton in the axes it came
    in), body, level; walk (LEVEL's room: the floor, the path over it, the camera, and what goes along with the person);
    rotation (expected errors); angles/<angle> with the ends of its 90 % band; marks (moments of events); events
    (notices); provenance.
    What the take lacks is left out, what is NaN stays NaN, and where a track has no rows for some frames, one row
    of NaN ends what is shown.

    A take whose `told.images` is False leaves the video out. Raises InputError without poses, rectified poses
    or time stamps, or when the video cannot be read.
    """
    import rerun as rr

    poses, rectified = take.need("poses"), take.need("rectified")
    parts = viewable(take.video) if take.told.images and take.video else None
    take = take.with_(video=take.video if parts else None)
    size = half_height(poses.without_feet.joints)

    path = Path(path)
    needed = _FIXED_BYTES + _FRAME_BYTES * len(poses) + (take.video.span_bytes if take.video else 0)
    require_space(path.parent, needed, "The recording")
    with whole_file(path) as partial, recording_file(partial, views(take, size), path) as file:
        give_memory_back()
        recording = file.stream
        recording.send_recording_name(take.name)
        if take.video and parts:
            log_video(recording, parts, on_clock(take.video, poses), take.video.span[0])
        file.check()
        last = _last_frame(take)
        gaps = _gap_rows(poses, last)
        if take.keypoints is not None:
            keypoints = _gaps_marked(take.keypoints, _gap_rows(take.keypoints, last))
            log_skeleton(recording, "video/keypoints", keypoints, radius=-3.0)
        for entity, skeleton, radius in (
            ("source", poses, 0.024),
            ("body", rectified.body, 0.024),
            ("level", rectified.level, 0.04),
        ):
            log_skeleton(recording, entity, _gaps_marked(skeleton, gaps), radius * size)
        clock = _gaps_marked(poses, gaps)
        _log_rotation(recording, rectified, clock, gaps)
        file.check()
        log_room(recording, take, size)
        log_marks(recording, take)
        log_angles(recording, take, clock, gaps)
        log_notices(recording, take.said, poses)
        lines = "\n".join(f"- {name}: {text}" for name, text in provenance(take).items())
        text = rr.TextDocument(lines, media_type=rr.MediaType.MARKDOWN)
        recording.log("provenance", text, static=True)


def _log_rotation(
    recording: rr.RecordingStream, rectified: Rectified, clock: PoseSequence, gaps: np.ndarray
) -> None:
    """clock: the poses with their gaps marked (`_gaps_marked`). gaps: (N,) as of `_gap_rows`."""
    curves = {
        "error": ("expected error (deg)", rectified.error_deg, PURPLE),
        "bound": ("90 % bound of up (deg)", rectified.up_bound_deg, MIDDLE),
    }
    for entity, (name, values, colour) in curves.items():
        if np.isfinite(values).any():
            log_curves(
                recording, f"rotation/{entity}", clock, np.insert(values, gaps, np.nan), [name], [colour]
            )


def _last_frame(take: Take) -> int:
    """The last that anything of the take shows."""
    tracks = [track.frame_index[-1] for track in (take.poses, take.keypoints) if track is not None]
    return max(*tracks, take.video.span[1] if take.video else 0)


def _gap_rows(poses: PoseSequence, last: int) -> np.ndarray:
    """(N,) rows before which `np.insert` puts one of NaN: behind each that another does not follow at the usual step,
    which is of two frames where poses are of every second, and behind the last where frames go on to `last`."""
    usual = np.median(np.diff(poses.frame_index)) if len(poses) > 1 else 1
    return np.flatnonzero(np.diff(poses.frame_index, append=last + 1) > usual) + 1


def _gaps_marked(poses: PoseSequence, rows: np.ndarray) -> PoseSequence:
    """The poses with a row of NaN before each of `rows` (N,), as of `_gap_rows`."""
    if not len(rows):  # a long take need not be copied
        return poses
    frame = np.insert(poses.frame_index, rows, poses.frame_index[rows - 1] + 1)
    time_s = np.interp(frame, poses.frame_index, poses.times)
    if frame[-1] > poses.frame_index[-1]:
        time_s[-1] += 1 / poses.fps if len(poses) > 1 else 1e-3
    return poses.on_frames(frame, time_s)


def views(take: Take, size: float) -> rrb.Container:
    """A tab for a first look: the video, the person on the floor, and below them knees, elbows and trunk; another for
    all else. Views of what the take lacks are not there.

    size: about half the person's height, in the poses' unit.
    """
    import rerun.blueprint as rrb

    flat = {"Video": take.video, "2D keypoints": take.keypoints}
    title = " and ".join(name for name, part in flat.items() if part is not None)
    video = [rrb.Spatial2DView(origin="video", name=title)] if title else []
    charts = first_angles(take)
    first = rrb.Vertical(
        rrb.Horizontal(*video, first_view(take, size)),
        *([rrb.Horizontal(*charts)] if charts else []),
        row_shares=[5, 3] if charts else [1],
        name="First look",
    )
    return rrb.Tabs(first, _details(take, size), active_tab=0)


def _details(take: Take, size: float) -> rrb.Container:
    """On the left the poses before and after, in the middle the path and the angles, on the right rotation and
    words."""
    import rerun.blueprint as rrb

    poses, rectified = take.need("poses"), take.need("rectified")
    source = poses.frame
    eyes = [size * frame.basis @ np.array(_EYES[frame.family]) for frame in (source, BODY)]
    texts: list[rrb.View] = []
    if take.said:
        columns = rrb.TextLogColumns(timeline_columns=["frame"], text_log_columns=["loglevel", "body"])
        texts.append(rrb.TextLogView(origin="events", name="Events", columns=columns))
    texts.append(rrb.TextDocumentView(origin="provenance", name="Provenance"))
    rotation = rrb.TimeSeriesView(origin="rotation", name="Rotation (deg)", plot_legend=rrb.Corner2D.LeftTop)
    columns = [
        [
            person_view("source", f"Before: {source.name} axes", eyes[0]),
            person_view("body", "After: BODY, facing you", eyes[1]),
        ],
        [
            *([walk_view(take, size)] if walked(rectified) else []),
            *angle_views(take),
        ],
        [rotation, rrb.Tabs(*texts, active_tab=0)],
    ]
    return rrb.Horizontal(*(rrb.Vertical(*column) for column in columns if column), name="Details")
