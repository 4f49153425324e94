"""The recording of a camera that runs: everything is written the moment it is known."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ....models.detector.protocols import Found
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import BODY, IMAGE
from ....pipeline.core.layouts import H36M17, Layout
from ....pipeline.core.pose import PoseSequence
from ...drawing.rerun_file import RecordingFile, recording_file
from ...drawing.rerun_log import log_looks, log_rows, person_view
from ...drawing.rerun_video import TICK, h264_stream
from .frames import LivePose
from .source import Shot

if TYPE_CHECKING:
    import rerun.blueprint as rrb
    from av.container import OutputContainer
    from av.video.stream import VideoStream

_SIZE = 0.85  # half a person's height in the lifter's unit
_BEHIND = 2  # images: enough for an uneven encoder; more would be memory and no gain
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
            recording = LiveRecording(file, layout, target if frames else None, beside)
            yield recording
            recording.finish()
    except FFmpegError as error:
        raise InputError(
            "cannot-write", f"The video {kept} could not be written: {error.strerror}."
        ) from None


class LiveRecording:
    """Entities: video, video/keypoints, body, rotation."""

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
        log_looks(recording, "body", H36M17, _BODY, 0.04 * _SIZE)
        for name, label in (("error", "expected error (deg)"), ("bound", "90 % bound of up (deg)")):
            recording.log(f"rotation/{name}", rr.SeriesLines(names=[label]), static=True)

    def log(self, shot: Shot, person: Found | None, pose: LivePose) -> None:
        """One image and what is known about it, written meanwhile; where the thread is _BEHIND images behind, that is
        waited for."""
        self._pending.append(self._beside.submit(self._strictly, shot, person, pose))
        while len(self._pending) > _BEHIND:
            self._pending.popleft().result()

    def _strictly(self, shot: Shot, person: Found | None, pose: LivePose) -> None:
        from rerun.error_utils import catch_and_log_exceptions

        with catch_and_log_exceptions(strict=True):  # which is of one thread
            self._write(shot, person, pose)

    def _write(self, shot: Shot, person: Found | None, pose: LivePose) -> None:
        import rerun as rr

        self._file.check()
        recording = self._recording
        recording.set_time("frame", sequence=shot.number)
        recording.set_time("video_time", duration=shot.time_s)
        if self._target is not None:
            self._log_image(self._target, shot)
        pixels = np.full((len(self._layout), 2), np.nan) if person is None else person.xy
        for entity, joints, layout, frame in (
            ("video/keypoints", pixels, self._layout, IMAGE),
            ("body", pose.body, H36M17, _BODY),
        ):
            index, time_s = np.array([shot.number]), np.array([shot.time_s])
            log_rows(
                recording,
                entity,
                PoseSequence(joints[None], layout, frame, frame_index=index, time_s=time_s),
            )
        recording.log("rotation/error", rr.Scalars(pose.error_deg))
        recording.log("rotation/bound", rr.Scalars(pose.up_bound_deg))

    def finish(self) -> None:
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
            self._encoder = h264_stream(target, width, height, 30, at_once=True)
            self._recording.log("video", rr.VideoStream(codec=rr.VideoCodec.H264), static=True)
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(shot.image[:height, :width]), "rgb24")
        image.pts, image.time_base = round(shot.time_s / TICK), TICK
        for packet in self._encoder.encode(image):
            sample = np.frombuffer(bytes(packet), np.uint8)
            self._recording.log("video", rr.VideoStream.from_fields(sample=sample))
            target.mux(packet)


def _views() -> rrb.Container:
    import rerun as rr
    import rerun.blueprint as rrb

    eye = _SIZE * np.array((-1.8, 0.9, 0.4))
    at_the_feet = rr.components.Plane3D.XY.with_distance(-_SIZE)
    floor = rrb.LineGrid3D(plane=at_the_feet, spacing=_SIZE / 4, color=(128, 128, 128, 110))
    body = person_view("body", "BODY: the person faces you", eye, floor=floor)
    rotation = rrb.TimeSeriesView(origin="rotation", name="Rotation (deg)")
    video = rrb.Spatial2DView(origin="video", name="Video and 2D keypoints")
    return rrb.Horizontal(rrb.Vertical(video, rotation, row_shares=[3, 1]), body)
