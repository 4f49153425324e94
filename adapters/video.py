"""Videos, described without decoding them: size, rotation, codec and every frame's time stamp.

FFmpeg reads the containers that cameras and editors write. Others are refused, so that no playlist or script
can make it open further files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.system import cores
from ..pipeline.core.take import Video
from ..pipeline.files.opened import first_bytes
from ..pipeline.files.video_frames import opened

if TYPE_CHECKING:
    from av import VideoStream
    from av.container import InputContainer

name = "video"
gives = "video"
reads = "video: MP4, MOV, MKV, WebM, AVI, WMV, FLV, MPEG (PS, TS, M2TS), GIF"

_FOCAL_35_MM = re.compile(r"camera\.focal_length\.35mm_equivalent$")  # com.apple.quicktime.camera...
_DURATION = re.compile(r"(\d+):(\d+):(\d+(?:\.\d*)?)")  # of a track, in Matroska
_SHORT_S = 0.5  # by which images may end before the file does: sound goes on, or stamps are rounded
_SQUARE = 0.02  # odd sizes of re-encoded videos have pixels that are nearly square
# com.android.capture.fps of phones' slow motion.
_CAPTURE_RATE = re.compile(r"capture[._-]?fps$", re.IGNORECASE)
_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")  # ISO base media, and QuickTime before it
_STARTS = (
    b"\x1a\x45\xdf\xa3",  # Matroska, WebM
    b"\x30\x26\xb2\x75\x8e\x66\xcf\x11",  # WMV
    b"FLV\x01",
    b"\x00\x00\x01\xba",  # MPEG programme stream
    b"GIF8",
)
# MPEG transport stream and M2TS: where the first sync byte 0x47 is, and how far apart they are.
_SYNC_BYTES = ((0, 188), (4, 192))


def sniff(path: Path) -> bool:
    """Whether the file begins like a video container; only its first bytes are read."""
    head = first_bytes(path, 1024)
    return (
        (head[:1] == b"\0" and head[4:8] in _BOXES)
        or head.startswith(_STARTS)
        or (head[:4] == b"RIFF" and head[8:12] == b"AVI ")
        or any(head[start::step][:5] == b"\x47" * 5 for start, step in _SYNC_BYTES)
    )


def read(path: Path) -> tuple[Video]:
    """The file's first moving image. time_s comes from the container, sorted into display order.

    Frames that an edit list cuts away are left out, as decoders do. rotation_deg is the clockwise turn that
    the display matrix asks for (0, 90, 180 or 270). Only the first frame is decoded, to learn it. doubts: notices of
    images that end well before the file's stated end, if no index lists them, and of interlaced ones.
    Raises InputError when there is no readable video, when the file is cut off, and when frames have no time stamps of
    their own.
    """
    if not sniff(path):
        from ..pipeline.reading.load import in_words

        raise InputError(
            "format-unknown",
            f"Expected a video in {path} ({reads.removeprefix('video: ')}), got something else: {in_words(path)}.",
        )
    from av.error import FFmpegError

    try:
        with opened(path) as container:
            return (_described(container, path),)
    except FFmpegError as error:
        raise InputError(
            "file-damaged",
            f"Expected a video in {path}, but it cannot be read ({error.strerror}); it may be cut off or damaged: "
            "copy it again.",
        ) from None


def _described(container: InputContainer, path: Path) -> Video:
    if not container.streams.video:
        raise InputError("format-unknown", f"Expected a video in {path}, but it has no video stream.")
    stream = container.streams.video[0]
    if stream.codec_context is None:  # as of a file that names a codec that does not exist
        raise InputError("file-damaged", f"Expected a video in {path}, but its images are of no known kind.")
    stream.codec_context.thread_count = cores()
    # Counted before packets are read, which lengthens the index of some containers.
    indexed = len(stream.index_entries)
    # Entries that lie behind the file's end; containers without a full index have none to check.
    if any(entry.pos + entry.size > container.size for entry in stream.index_entries):
        raise InputError(
            "file-damaged",
            f"Expected a whole video in {path}, but the file ends before frames that its index lists: it is cut off; "
            "copy it again, or rewrite what is left of it with ffmpeg.",
        )
    _refuse_flat_pixels(stream, path)
    stamps, keys, first = [], [], None
    for packet in container.demux(stream):
        if first is None:
            first = next(iter(packet.decode()), None)
        if packet.size and not packet.is_discard:
            stamps.append(packet.pts)
            if packet.is_keyframe:
                keys.append(packet.pts)
    if first is None:
        raise InputError(
            "file-damaged", f"Expected a video in {path}, but it has no frame that can be decoded."
        )
    time_s = _times(stamps, path) * float(stream.time_base or 0)
    ends_s = max(stamp for stamp in stamps if stamp is not None) * float(stream.time_base or 0)
    film_mm = _stated(container.metadata, _FOCAL_35_MM, 8, 1000)
    side = max(stream.codec_context.width, stream.codec_context.height)
    return Video(
        path=path,
        width=stream.codec_context.width,
        height=stream.codec_context.height,
        time_s=time_s,
        key_frames=tuple(np.searchsorted(np.sort(stamps), np.sort(keys)).tolist()),
        codec=stream.codec_context.codec.canonical_name,
        # PyAV gives the display matrix's angle anticlockwise.
        rotation_deg=round(-first.rotation / 90) % 4 * 90,
        # As that of a camera with 36 mm of film, in pixels of the longer side.
        focal_px=None if film_mm is None else film_mm / 36.0 * side,
        capture_fps=_stated({**container.metadata, **stream.metadata}, _CAPTURE_RATE, 1, 100_000),
        doubts=(
            *(_cut_off(time_s, ends_s, _stated_s(container, stream), path) if indexed < len(stamps) else ()),
            *((notice("interlaced"),) if first.interlaced_frame else ()),
        ),
    )


def _stated_s(container: InputContainer, stream: VideoStream) -> float:
    """The second at which the images end, as the file states; or its whole duration if it states no other and holds
    nothing but images (sound may go on longer); 0 if it states neither. It is written when a video is complete, so a
    video that is cut off later still has it."""
    if stream.duration is not None:
        return stream.duration * float(stream.time_base or 0)
    if duration := _DURATION.match(stream.metadata.get("DURATION", "")):
        hours, minutes, seconds = map(float, duration.groups())
        return 3600 * hours + 60 * minutes + seconds
    return (container.duration or 0) / 1e6 if len(container.streams) == 1 else 0.0  # FFmpeg's AV_TIME_BASE


def _cut_off(time_s: np.ndarray, ends_s: float, stated_s: float, path: Path) -> tuple[Notice, ...]:
    """A notice where images end well before the file says. ends_s: the last one's stamp by the file's own clock, on
    which some do not begin at 0; its usual time on the screen is added."""
    ends_s += float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    if stated_s - ends_s <= _SHORT_S:
        return ()
    return (
        notice(
            "video-damaged",
            damage=f"The images of {path.name} end after {ends_s:.1f} s of {stated_s:.1f} s, so it may be cut off",
            ends_s=ends_s,
            stated_s=stated_s,
        ),
    )


def _refuse_flat_pixels(stream: VideoStream, path: Path) -> None:
    """InputError for pixels that players show wider or narrower than high, as of DV and HDV: detectors differ in
    whether they obey that, so keypoints could mean either, and a body would come out stretched."""
    ratio = float(stream.codec_context.sample_aspect_ratio or stream.sample_aspect_ratio or 1)
    if abs(ratio - 1) > _SQUARE:
        raise InputError(
            "wrong-axes",
            f"Expected square pixels in {path}, but players show them {ratio:.3g} times as wide as high; convert the "
            "video, ffmpeg -i IN -vf scale=iw*sar:ih,setsar=1 OUT, and detect in the new one.",
        )


def _stated(metadata: Mapping[str, str], key: re.Pattern[str], low: float, high: float) -> float | None:
    """The number from low to high that phones write under a key; None where there is none."""
    for name, value in metadata.items():
        if key.search(name):
            with suppress(ValueError):
                return number if low <= (number := float(value)) <= high else None
    return None


def _times(stamps: list[int | None], path: Path) -> np.ndarray:
    """Time stamps in display order, from the first frame's 0, in ticks."""
    ticks = np.array(sorted(stamp for stamp in stamps if stamp is not None), dtype=np.float64)
    if len(ticks) < len(stamps) or (np.diff(ticks) <= 0).any():
        raise InputError(
            "times-broken",
            f"Expected a time stamp of its own for every frame of {path}, but {len(stamps) - len(np.unique(ticks))} of "
            f"{len(stamps)} have none; rewrite the video with ffmpeg, for example as H.264 in an .mp4.",
        )
    return ticks - ticks[0]
