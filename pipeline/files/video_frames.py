"""The images of a video, as players show them, one after the other; however long it is, a few are held at a time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..take import Video

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer
    from av.video.stream import VideoStream

_BACK_S = 10.0  # before where a key frame should be, in a file that is searched without an index


def images_from(video: Video, first: int = 0) -> Iterator[tuple[int, np.ndarray]]:
    """(frame number, image) from frame `first` on: (H, W, 3) uint8 RGB, the video's rotation obeyed.

    Numbers count the rows of `video.time_s`; a frame that the decoder leaves out is left out here too. Before `first`
    no more is decoded than lies between it and the key frame before it. InputError for a video that cannot be decoded.
    """
    for number, frame in frames_from(video, first):
        yield number, _upright(frame, video.rotation_deg)


def frames_from(video: Video, first: int = 0) -> Iterator[tuple[int, VideoFrame]]:
    """As `images_from`, the frames as they are stored. InputError as there."""
    import av
    from av.error import FFmpegError

    number = first
    try:
        with av.open(str(video.path), metadata_errors="ignore") as container:
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            tick = float(stream.time_base or 1)
            start = next((frame.pts for frame in container.decode(stream) if frame.pts is not None), 0)
            stamps = start + np.round(video.time_s / tick).astype(np.int64)
            if first >= len(stamps):
                return
            for frame in _decoded(container, stream, int(stamps[first]), start, round(_BACK_S / tick)):
                if frame.pts is None or frame.pts < stamps[first]:
                    continue
                number = int(np.searchsorted(stamps, frame.pts))
                if number < len(stamps) and stamps[number] == frame.pts:
                    yield number, frame
    except FFmpegError as error:
        raise InputError(
            f"The video {video.path} cannot be decoded beyond frame {number}: {error.strerror}; it may be damaged: "
            "copy it again, or rewrite it with ffmpeg."
        ) from None


def _decoded(
    container: InputContainer, stream: VideoStream, stamp: int, start: int, back: int
) -> Iterator[VideoFrame]:
    """The frames from the key frame before `stamp` on, or from an earlier one: in a file without an index, such as
    MPEG-TS, seeking may land behind it. All in ticks."""
    for target in (stamp, stamp - back, start):
        container.seek(max(target, start), stream=stream, backward=True)
        frames = container.decode(stream)
        landed = next((frame for frame in frames if frame.pts is not None), None)
        if landed is not None and (landed.pts or 0) <= stamp:
            yield landed
            yield from frames
            return


def images_at(video: Video, frames: Iterable[int]) -> dict[int, np.ndarray]:
    """The images (H, W, 3) uint8 RGB of these frame numbers; one that is not found is left out. InputError as for
    `images_from`."""
    found = {}
    for wanted in sorted(frames):
        number, image = next(images_from(video, wanted), (None, None))
        if number == wanted and image is not None:
            found[number] = image
    return found


def shown_size(video: Video) -> tuple[int, int]:
    """Width and height of the images, the video's rotation obeyed."""
    turned = video.rotation_deg in (90, 270)
    return (video.height, video.width) if turned else (video.width, video.height)


def _upright(frame: VideoFrame, rotation_deg: int) -> np.ndarray:
    image = frame.to_ndarray(format="rgb24", threads=1)  # starting threads for each frame costs more than they save
    return np.ascontiguousarray(np.rot90(image, -rotation_deg // 90)) if rotation_deg else image
