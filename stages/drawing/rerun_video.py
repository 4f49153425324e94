"""A video as the viewer can show it, in parts of a few megabytes, so that a long one is never held whole."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.system import cores
from ...pipeline.core.take import Video
from ...pipeline.files.video_frames import frames_from, opened

if TYPE_CHECKING:
    import rerun as rr
    from av import Packet, VideoFrame
    from av.container import OutputContainer
    from av.video.stream import VideoStream

PART_BYTES = 4 * 2**20  # a part ends with the first key frame behind so many
_MOST_BYTES = 128 * 2**20  # of a part that no key frame ends
_VIEWER_CODECS = ("h264", "hevc", "av1", "vp8", "vp9")
TICK = Fraction(1, 90_000)  # seconds; MPEG's usual time base
_UPRIGHT = {
    0: (),
    90: (("transpose", "clock"),),
    180: (("hflip",), ("vflip",)),
    270: (("transpose", "cclock"),),
}
_EVEN = ("crop", "trunc(iw/2)*2:trunc(ih/2)*2:0:0")


@dataclass(frozen=True, eq=False)
class Part:
    """Some consecutive frames of a video as a small video of their own.

    stamps_ns: (n,) time stamps in it by which the viewer finds its frames.
    """

    asset: rr.AssetVideo
    stamps_ns: np.ndarray


def viewable(video: Video) -> Iterator[Part]:
    """The video's own packets in parts, or an H.264 copy with the same time stamps, of what the viewer cannot play. The
    parts' frames are those of the video's span, in its order.

    The viewer plays H.264, H.265, AV1, VP8 and VP9 and ignores the rotation that a phone notes in the file.
    InputError when the video cannot be read, also while the parts are.
    """
    playable = video.part is None and not video.rotation_deg and video.codec in _VIEWER_CODECS
    parts = _own_parts(video) if playable else None
    return transcoded(video) if parts is None else parts


def _own_parts(video: Video) -> Iterator[Part] | None:
    """The video's own packets in parts, if they can be cut so that the viewer finds the video's frames in them."""
    starts = _starts(video)
    if starts is None:
        return None
    parts = _cut(video, starts)
    first = next(parts)
    expected = starts[1] if len(starts) > 1 else len(video.time_s)
    return chain([first], parts) if len(first.stamps_ns) == expected else None


def _starts(video: Video) -> list[int] | None:
    """The packets that parts begin with: key frames that no later frame is shown before, each the first behind
    PART_BYTES of the part before. None when frames are cut away by an edit list, have no time stamps, or when a part
    would be too long for want of such key frames."""
    stamps, sizes, keys = [], [], []
    for packet in _packets(video):
        if packet.is_discard or packet.pts is None or packet.dts is None:
            return None
        stamps.append(packet.pts)
        sizes.append(packet.size)
        keys.append(packet.is_keyframe)
    if len(stamps) != len(video.time_s):
        return None
    shown_last = np.minimum.accumulate(np.array(stamps)[::-1])[::-1]
    whole = np.flatnonzero(np.array(keys) & (np.array(stamps) == shown_last))
    bytes_before = np.concatenate([[0], np.cumsum(sizes)])
    starts = [0]
    for packet in whole:
        if bytes_before[packet] - bytes_before[starts[-1]] > PART_BYTES:
            starts.append(int(packet))
    longest = np.diff(bytes_before[[*starts, len(sizes)]]).max()
    return starts if longest <= _MOST_BYTES else None


def _packets(video: Video) -> Iterator[Packet]:
    """The packets of the video's images, in the order they are stored in."""
    from av.error import FFmpegError

    try:
        with opened(video.path) as source:
            yield from (packet for packet in source.demux(video=0) if packet.size)
    except FFmpegError as error:
        raise _unreadable(video, error) from None


def _cut(video: Video, starts: list[int]) -> Iterator[Part]:
    """The video's packets, untouched, in an MP4 file for each part."""
    import av

    first, buffer = set(starts), io.BytesIO()
    target, stream, shift = None, None, None
    for number, packet in enumerate(_packets(video)):
        if number in first:
            if target is not None:
                target.close()
                yield _mp4(buffer)
            buffer = io.BytesIO()
            target = av.open(buffer, "w", format="mp4")
            stream = target.add_stream_from_template(packet.stream)
            shift = packet.pts
        assert target is not None
        assert packet.pts is not None  # as _starts has seen
        assert packet.dts is not None
        assert shift is not None
        packet.stream, packet.pts, packet.dts = stream, packet.pts - shift, packet.dts - shift
        target.mux(packet)
    assert target is not None
    target.close()
    yield _mp4(buffer)


def _mp4(buffer: io.BytesIO) -> Part:
    import rerun as rr

    asset = rr.AssetVideo(contents=buffer.getvalue(), media_type="video/mp4")
    try:
        return Part(asset, np.asarray(asset.read_frame_timestamps_nanos()))
    except RuntimeError:
        return Part(asset, np.zeros(0, dtype=np.int64))


def transcoded(video: Video) -> Iterator[Part]:
    """The video's span as H.264 in MP4 files, upright, each frame at the time that `video.time_s` gives it.

    An odd last row or column of pixels is cut off, since yuv420p needs even sizes; the others keep their place.
    InputError when it cannot be decoded.
    """
    import av

    images = _upright(video)
    image = next(images, None)
    if image is None:
        raise InputError(
            "file-damaged", f"Expected a video in {video.path}, found no frame that can be decoded."
        )
    while image is not None:
        buffer = io.BytesIO()
        with av.open(buffer, "w", format="mp4") as target:
            encoder = h264_stream(target, image.width, image.height, video.fps)
            start = image.pts or 0
            while image is not None and buffer.tell() < PART_BYTES:
                image.pts = (image.pts or 0) - start
                target.mux(encoder.encode(image))
                image = next(images, None)
            target.mux(encoder.encode(None))
        yield _mp4(buffer)


def _upright(video: Video) -> Iterator[VideoFrame]:
    """The frames as they are shown, in yuv420p, each at the time that `video.time_s` gives it."""
    from av.error import FFmpegError
    from av.filter import Graph

    try:
        graph = None
        stamps = np.round(video.time_s / float(TICK)).astype(int).tolist()
        first, last = video.span
        for number, frame in frames_from(video, first):
            if graph is None:
                graph = Graph()
                graph.threads = cores()
                filters = (*_UPRIGHT[video.rotation_deg], _EVEN, ("format", "yuv420p"), ("buffersink",))
                buffer = graph.add_buffer(None, frame.width, frame.height, frame.format, time_base=TICK)
                graph.link_nodes(buffer, *(graph.add(*f) for f in filters)).configure()
            graph.vpush(frame)
            image = graph.vpull()
            image.pts, image.time_base = stamps[number], TICK
            yield image
            if number == last:
                break
    except FFmpegError as error:
        raise _unreadable(video, error) from None


def _unreadable(video: Video, error: Exception) -> InputError:
    return InputError("file-damaged", f"The video {video.path} cannot be converted for the viewer: {error}.")


def h264_stream(target: OutputContainer, width: int, height: int, fps: float) -> VideoStream:
    """A new H.264 stream of a file that is written, for images of even width and height, whose stamps count TICK.
    fps: what it says of itself, 30 where it is not known."""
    # No B-frames: they are decoded out of order. Short groups: the viewer seeks quickly. force-cfr: the stream
    # itself names the frame rate, not the tick; at "90k" frames a second the viewer's decoder never starts.
    options = {"crf": "20", "preset": "veryfast", "bf": "0", "g": "30", "x264-params": "force-cfr=1"}
    rate = Fraction(fps if np.isfinite(fps) else 30).limit_denominator(1001)
    stream = target.add_stream("libx264", rate=rate, options=options)
    stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
    stream.codec_context.time_base = TICK
    stream.codec_context.thread_count = cores()
    return stream


def on_clock(video: Video, poses: PoseSequence) -> np.ndarray:
    """(N,) seconds of the video's frames on the poses' clock: the file's own time stamps, unless the poses were
    given another rate (slow motion)."""
    index, times = poses.frame_index, poses.times
    frame = np.arange(len(video.time_s))
    within = index < len(frame)
    if np.allclose(video.time_s[index[within]], times[within], atol=1e-3):
        return video.time_s
    nearest = np.clip(frame, index[0], index[-1])
    rate = poses.fps if len(poses) > 1 else video.fps
    return np.interp(nearest, index, times) + (frame - nearest) / rate
