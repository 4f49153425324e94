"""The recording: everything about a take on one time axis, in one file for the rerun viewer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.system import give_memory_back
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import require_space, whole_file
from ...pipeline.files.names import RECORDING
from ..drawing.palette import MIDDLE, PURPLE
from ..drawing.provenance import provenance
from ..drawing.rerun_file import recording_file
from ..drawing.rerun_log import (
    half_height,
    log_curves,
    log_notices,
    log_skeleton,
    log_video,
)
from ..drawing.rerun_video import on_clock, viewable
from .angles import log_angles, log_marks
from .gaps import gap_rows, gaps_marked, last_frame
from .room import log_room
from .views import views

if TYPE_CHECKING:
    import rerun as rr

_FRAME_BYTES, _FIXED_BYTES = 2048, 1 << 20  # of a recording without its video; 10,000 frames take 17 MB


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
        last = last_frame(take)
        gaps = gap_rows(poses, last)
        if take.keypoints is not None:
            keypoints = gaps_marked(take.keypoints, gap_rows(take.keypoints, last))
            log_skeleton(recording, "video/keypoints", keypoints, radius=-3.0)
        for entity, skeleton, radius in (
            ("source", poses, 0.024),
            ("body", rectified.body, 0.024),
            ("level", rectified.level, 0.04),
        ):
            log_skeleton(recording, entity, gaps_marked(skeleton, gaps), radius * size)
        clock = gaps_marked(poses, gaps)
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
    """clock: the poses with their gaps marked (`gaps_marked`). gaps: (N,) as of `gap_rows`."""
    curves = {
        "error": ("expected error (deg)", rectified.error_deg, PURPLE),
        "bound": ("90 % bound of up (deg)", rectified.up_bound_deg, MIDDLE),
    }
    for entity, (name, values, colour) in curves.items():
        if np.isfinite(values).any():
            log_curves(
                recording, f"rotation/{entity}", clock, np.insert(values, gaps, np.nan), [name], [colour]
            )
