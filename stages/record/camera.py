"""How the image told which way is up: one frame with its straight lines by direction and the horizon."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.intrinsics import undistorted_image
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.files.video_frames import images_at
from ..drawing.facts import up_of_camera
from ..drawing.image_lines import COLOURS, HORIZON, UP, horizon, up_arrow
from ..drawing.rerun_log import time_columns

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_QUALITY = 80  # of JPEG


def looked(take: Take) -> bool:
    """Whether an image told which way is up."""
    return take.camera is not None and bool(take.camera.looks)


def log_camera(recording: rr.RecordingStream, take: Take) -> None:
    """camera/image, camera/lines, camera/horizon and camera/up; nothing where no image told up."""
    import rerun as rr

    if take.camera is None or not take.camera.looks:
        return
    look = take.camera.looks[0]
    if take.told.images and take.video is not None:
        for image in images_at(take.video, [look.frame]).values():
            recording.log(
                "camera/image",
                rr.Image(undistorted_image(image, take.camera.intrinsics)).compress(jpeg_quality=_QUALITY),
                static=True,
            )
    lines = look.ends[look.runs_along >= 0]
    colours = [COLOURS[int(along)] for along in look.runs_along if along >= 0]
    recording.log("camera/lines", rr.LineStrips2D(lines, colors=colours, radii=[-1.0]), static=True)
    edge = horizon(take.camera, look.up)
    if edge is not None:
        recording.log("camera/horizon", rr.LineStrips2D([edge], colors=[HORIZON], radii=[-1.5]), static=True)
    foot, tip = up_arrow(take.camera, look)
    arrow = rr.Arrows2D(origins=[foot], vectors=[np.asarray(tip - foot)], colors=[UP], radii=[-2.0])
    recording.log("camera/up", arrow, static=True)


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


def camera_view(take: Take) -> rrb.View:
    """The frame with its lines."""
    import rerun.blueprint as rrb

    width, height = take.need("camera").image_size
    bounds = rrb.VisualBounds2D(x_range=(0, width), y_range=(0, height))
    tells = take.need("rectified").up_shares.get("image", 0.0) > 0
    name = (
        "Lines that show which way is up, horizon"
        if tells
        else "Lines of the image (not used for up), horizon"
    )
    return rrb.Spatial2DView(origin="camera", name=name, visual_bounds=bounds)
