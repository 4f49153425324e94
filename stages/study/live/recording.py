"""The recording of a camera that runs: everything is written the moment it is known."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ....models.detector.protocols import Found
from ....models.gravity.live import LiveFrame
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import BODY, CAMERA, IMAGE
from ....pipeline.core.layouts import H36M17, Layout
from ....pipeline.core.pose import PoseSequence
from ....pipeline.core.rotations import rotate, transpose
from ...drawing.rerun_file import RecordingFile, recording_file
from ...drawing.rerun_log import log_body_looks, log_body_now, log_looks, log_rows, person_view
from .source import Shot

if TYPE_CHECKING:
    import rerun.blueprint as rrb
    from av.container import OutputContainer
    from av.video.stream import VideoStream

_SIZE = 0.85  # half a person's height in the lifter's unit
_TICK = Fraction(1, 90_000)
_BEHIND = 2  # images: enough for an uneven encoder; more would be memory and no gain
_SOURCE = CAMERA.with_(origin="pelvis", unit="arbitrary")
_BODY = BODY.with_(unit="arbitrary")


@contextmanager
def live_recording(path: Path, layout: Layout, video: Path | None, frames: bool) -> Iterator[LiveRecording]:
    """A recording that is closed properly however the block ends. layout: of the keypoints. video: an MPEG-TS file
    to keep the images in as well. frames: False keeps every image out of both. InputError when it cannot be
    written."""
    import av
    from av.error import FFmpegError

    kept = os.devnull if video is None or not frames else str(video)
    # The thread ends, with all that it was given, before the files are closed.
    try:
        with (
            av.open(kept, "w", format="mpegts") as target,
            recording_file(path, _views(), following=True) as file,
            ThreadPoolExecutor(1, "recording") as beside,
        ):
            yield LiveRecording(file, layout, target if frames else None, beside)
    except FFmpegError as error:
        raise InputError(
            "cannot-write", f"The video {kept} could not be written: {error.strerror}."
        ) from None


class LiveRecording:
    """Entities as in `record`: video, video/keypoints, source, body; rotation. And body/surface: the person drawn as
    tapered bones."""

    def __init__(
        self, file: RecordingFile, layout: Layout, target: OutputContainer | None, beside: ThreadPoolExecutor
    ) -> None:
        """target: what the encoded images go into besides the recording; None without images. beside: a thread that
        writes, for encoding an image takes about as long as finding the pose in the next one."""
        import rerun as rr

        recording = file.stream
        self._file, self._recording, self._layout, self._target = file, recording, layout, target
        self._beside, self._pending = beside, deque[Future[None]]()
        self._encoder: VideoStream | None = None
        log_looks(recording, "video/keypoints", layout, IMAGE, -3.0)
        log_looks(recording, "source", H36M17, _SOURCE, 0.024 * _SIZE)
        log_looks(recording, "body", H36M17, _BODY, 0.024 * _SIZE)
        log_body_looks(recording, "body/surface")
        for name, words in (("error", "expected error (deg)"), ("bound", "90 % bound of up (deg)")):
            recording.log(f"rotation/{name}", rr.SeriesLines(names=[words]), static=True)

    def log(self, shot: Shot, found: Found | None, joints: np.ndarray, live: LiveFrame) -> None:
        """One image and what is known about it, written meanwhile; where the thread is _BEHIND images behind, that is
        waited for. joints: (17, 3), CAMERA axes."""
        self._pending.append(self._beside.submit(self._strictly, shot, found, joints, live))
        while len(self._pending) > _BEHIND:
            self._pending.popleft().result()

    def _strictly(self, shot: Shot, found: Found | None, joints: np.ndarray, live: LiveFrame) -> None:
        from rerun.error_utils import catch_and_log_exceptions

        with catch_and_log_exceptions(strict=True):  # which is of one thread
            self._write(shot, found, joints, live)

    def _write(self, shot: Shot, found: Found | None, joints: np.ndarray, live: LiveFrame) -> None:
        import rerun as rr

        self._file.check()
        recording = self._recording
        recording.set_time("frame", sequence=shot.number)
        recording.set_time("video_time", duration=shot.time_s)
        if self._target is not None:
            self._log_image(self._target, shot)
        pixels = np.full((len(self._layout), 2), np.nan) if found is None else found.xy
        body = rotate(transpose(live.R_camera_from_body), joints)
        for entity, shown, layout, frame in (
            ("video/keypoints", pixels, self._layout, IMAGE),
            ("source", joints, H36M17, _SOURCE),
            ("body", body, H36M17, _BODY),
        ):
            row = PoseSequence(
                shown[None],
                layout,
                frame,
                frame_index=np.array([shot.number]),
                time_s=np.array([shot.time_s]),
            )
            log_rows(recording, entity, row)
        log_body_now(recording, "body/surface", body, H36M17)
        recording.log("rotation/error", rr.Scalars(live.error_deg))
        recording.log("rotation/bound", rr.Scalars(live.up_bound_deg))

    def close(self) -> None:
        """The last images, also those in the encoder."""
        while self._pending:
            self._pending.popleft().result()
        if self._target is not None and self._encoder is not None:
            self._target.mux(self._encoder.encode(None))

    def _log_image(self, target: OutputContainer, shot: Shot) -> None:
        import av
        import rerun as rr

        height, width = (side // 2 * 2 for side in shot.image.shape[:2])  # yuv420p needs even sizes
        if self._encoder is None:
            # "zerolatency": every image comes out at once, and none is stored out of order.
            options = {"crf": "23", "preset": "veryfast", "tune": "zerolatency", "g": "30"}
            self._encoder = target.add_stream("libx264", rate=30, options=options)
            self._encoder.width, self._encoder.height, self._encoder.pix_fmt = width, height, "yuv420p"
            self._encoder.codec_context.time_base = _TICK
            self._recording.log("video", rr.VideoStream(codec=rr.VideoCodec.H264), static=True)
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(shot.image[:height, :width]), "rgb24")
        image.pts, image.time_base = round(shot.time_s / _TICK), _TICK
        for packet in self._encoder.encode(image):
            sample = np.frombuffer(bytes(packet), np.uint8)
            self._recording.log("video", rr.VideoStream.from_fields(sample=sample))
            target.mux(packet)


def _views() -> rrb.Container:
    import rerun.blueprint as rrb

    eye, camera = (_SIZE * np.array(place) for place in ((-1.8, 0.9, 0.4), (0.5, -0.4, -2.4)))
    first, second = (rrb.Spatial2DView(origin="video", name="Video and 2D keypoints") for _ in range(2))
    before = rrb.Spatial3DView(
        origin="source",
        name="Before: CAMERA axes",
        eye_controls=rrb.EyeControls3D(position=camera, look_target=(0, 0, 0)),
    )
    # The floor is at about the height of the feet.
    now, after = (
        person_view("body", f"{when}: BODY, facing you", eye, grid=(-_SIZE, _SIZE / 4), contents=contents)
        for when, contents in (
            ("Now", ["$origin/surface/**"]),
            ("After", ["$origin/joints", "$origin/bones"]),
        )
    )
    details = rrb.Horizontal(
        rrb.Vertical(second, before),
        after,
        rrb.TimeSeriesView(origin="rotation", name="Rotation (deg)"),
        column_shares=[3, 4, 4],
        name="Details",
    )
    return rrb.Tabs(rrb.Horizontal(first, now, name="First look"), details, active_tab=0)
