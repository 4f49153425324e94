"""The horizon in the recording's video, by the take's up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ..drawing.facts import up_of_camera
from ..drawing.image_lines import HORIZON, horizon
from ..drawing.rerun_log import time_columns

if TYPE_CHECKING:
    import rerun as rr


def log_horizon(recording: rr.RecordingStream, take: Take) -> None:
    """video/horizon, by the take's up; nothing where the take is not levelled, the focal length not known, or the
    lens bends the line."""
    import rerun as rr

    camera, poses = take.camera, take.need("poses")
    if camera is None or camera.intrinsics is not None:
        return
    ups = up_of_camera(take)
    steady = take.need("rectified").R_source_from_level.ndim == 2
    edges = [horizon(camera, up) if is_finite(up) else None for up in (ups[:1] if steady else ups)]
    look = rr.LineStrips2D.from_fields(colors=[HORIZON], radii=[-0.6])
    recording.log("video/horizon", look, static=True)
    if steady:
        recording.log(
            "video/horizon", rr.LineStrips2D([each for each in edges if each is not None]), static=True
        )
        return
    columns = rr.LineStrips2D.columns(strips=[each for each in edges if each is not None])
    rows = columns.partition([int(each is not None) for each in edges])
    recording.send_columns("video/horizon", time_columns(poses.frame_index, poses.times), rows)
