"""A video as the viewer can show it: as it is where possible, transcoded once where not."""

from __future__ import annotations

import io
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from ..pipeline.errors import InputError
from ..pipeline.pose import PoseSequence
from ..pipeline.take import Event, Video

if TYPE_CHECKING:
    import rerun as rr
    from av import VideoFrame
    from av.container import OutputContainer
    from av.video.stream import VideoStream

_VIEWER_CODECS = ("h264", "hevc", "av1", "vp8", "vp9")
_MOST_BYTES = 2**31 - 1  # of one value in a recording
_TICK = Fraction(1, 90_000)  # MPEG's usual time base
_UPRIGHT = {
    0: (),
    90: (("transpose", "clock"),),
    180: (("hflip",), ("vflip",)),
    270: (("transpose", "cclock"),),
}
_EVEN = ("crop", "trunc(iw/2)*2:trunc(ih/2)*2:0:0")


def viewable(video: Video) -> tuple[rr.AssetVideo, tuple[Event, ...]]:
    """The video's file itself, or an H.264 copy with the same time stamps and an event that says why.

    The viewer plays H.264, H.265, AV1, VP8 and VP9 in MP4 and MOV files and ignores the rotation that a phone
    notes in the file. InputError when the video cannot be read or is larger than a recording can hold.
    """
    import rerun as rr

    if video.path.stat().st_size > _MOST_BYTES:
        raise InputError(
            f"A recording holds videos of up to 2 GiB, {video.path} is larger; "
            "give a shorter or smaller copy, or pass --no-frames."
        )
    if video.rotation_deg:
        reason = f"its picture is stored turned by {video.rotation_deg} degrees, which the viewer ignores"
    elif video.codec not in _VIEWER_CODECS:
        reason = f"the viewer does not play its codec, {video.codec}"
    else:
        # Named so because the viewer goes by the name; MOV is the same format to its parser.
        asset = rr.AssetVideo(path=video.path, media_type="video/mp4")
        if _frames(asset) == len(video.time_s):
            return asset, ()
        reason = f"the viewer does not find just its {len(video.time_s)} frames in the file"
    said = Event("note", f"The recording holds an H.264 copy of the video, because {reason}.")
    return rr.AssetVideo(contents=transcoded(video), media_type="video/mp4"), (said,)


def _frames(asset: rr.AssetVideo) -> int:
    """How many the viewer sees: none in other containers, too many where an edit list cuts some away."""
    try:
        return len(asset.read_frame_timestamps_nanos())
    except RuntimeError:
        return 0


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


def transcoded(video: Video) -> bytes:
    """The video as H.264 in MP4, upright, each frame at the time that `video.time_s` gives it.

    An odd last row or column of pixels is cut off, since yuv420p needs even sizes; the others keep their place.
    """
    import av
    from av.error import FFmpegError
    from av.filter import Graph

    stamps = np.round(video.time_s / float(_TICK)).astype(int).tolist()
    buffer, encoder = io.BytesIO(), None
    try:
        with av.open(str(video.path)) as source, av.open(buffer, "w", format="mp4") as target:
            stream = source.streams.video[0]
            stream.thread_type = "AUTO"
            graph = Graph()
            filters = (*_UPRIGHT[video.rotation_deg], _EVEN, ("format", "yuv420p"), ("buffersink",))
            graph.link_nodes(graph.add_buffer(template=stream), *(graph.add(*f) for f in filters)).configure()
            for frame, stamp in zip(source.decode(stream), stamps, strict=False):
                graph.vpush(frame)
                picture = graph.vpull()
                picture.pts, picture.time_base = stamp, _TICK
                encoder = encoder or _encoder(target, picture, video.fps)
                target.mux(encoder.encode(picture))
            if encoder is None:
                raise InputError(f"Expected a video in {video.path}, found no frame that can be decoded.")
            target.mux(encoder.encode(None))
    except FFmpegError as error:
        raise InputError(f"The video {video.path} cannot be converted for the viewer: {error}.") from None
    return buffer.getvalue()


def _encoder(target: OutputContainer, picture: VideoFrame, fps: float) -> VideoStream:
    # No B-frames: they are decoded out of order. Short groups: the viewer seeks quickly. force-cfr: the stream
    # itself names the frame rate, not the tick; at "90k" frames a second the viewer's decoder never starts.
    options = {"crf": "20", "preset": "veryfast", "bf": "0", "g": "30", "x264-params": "force-cfr=1"}
    rate = Fraction(fps if np.isfinite(fps) else 30).limit_denominator(1001)
    stream = target.add_stream("libx264", rate=rate, options=options)
    stream.width, stream.height, stream.pix_fmt = picture.width, picture.height, "yuv420p"
    stream.codec_context.time_base = _TICK
    return stream
