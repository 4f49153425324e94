"""Where live images come from: a camera, a stream, a pipe, or a file, which waits or is played in real time."""

from __future__ import annotations

import os
import stat
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.cores import cores
from ....pipeline.core.errors import InputError
from ....pipeline.core.take import Video
from ....pipeline.files.video_frames import CONTAINERS, images_from
from ....pipeline.reading.load import read_video

_PROTOCOLS = ("rtsp", "rtsps", "rtmp", "rtp", "srt", "udp", "tcp", "http", "https")
# FFmpeg's names of what else comes as a stream. A playlist (HLS, DASH) is none of them: it names further addresses.
_STREAMS = "rtsp,rtp,sdp,mpjpeg,mjpeg,h264,hevc,m4v,mpegvideo,ogg,nut,yuv4mpegpipe"
_ASK_S = 0.1
_NEEDED = "tls,crypto"  # what those are built on; no playlist from elsewhere may name files of this machine


@dataclass(frozen=True, eq=False)
class Shot:
    """number: from 0, of the images that were not dropped; of a file its frame number. time_s: from the first one.
    image: (H, W, 3) uint8 RGB, upright. came_s: when the image was there, by time.perf_counter; of one that waits, when
    it was taken; of a file in real time, when it was due."""

    number: int
    time_s: float
    image: np.ndarray
    came_s: float = field(default_factory=time.perf_counter)


@dataclass(frozen=True, eq=False)
class Source:
    """name: in words. video: the file, where it is one. waits: whether images wait for who takes them: those of a file
    do, unless it is played in real time."""

    name: str
    shots: Iterator[Shot]
    video: Video | None
    waits: bool


def open_source(source: str, realtime: bool = False) -> Source:
    """A camera by its number or device, a URL, "-" for a pipe into stdin, or a video file. realtime: a file is played
    at its own speed, and its images do not wait.

    InputError when it cannot be opened, or later when it breaks; for another source in real time, which it is anyhow.
    """
    opened = _opened(source)
    if not realtime:
        return opened
    if not opened.waits:
        raise InputError(
            "option-conflict",
            f"Expected a video file to play in real time, got a {opened.name}, which sets its own pace; leave "
            "--realtime out.",
        )
    return replace(opened, shots=_paced(opened.shots), waits=False)


def _paced(shots: Iterator[Shot]) -> Iterator[Shot]:
    """Each image at its time from the first one on."""
    start: float | None = None
    for shot in shots:
        now = time.perf_counter()
        start = now - shot.time_s if start is None else start
        time.sleep(max(start + shot.time_s - now, 0.0))
        # Its own time: one that was decoded too slowly is late already.
        yield replace(shot, came_s=start + shot.time_s)


def _opened(source: str) -> Source:
    if source.isdigit() or Path(source).is_char_device():
        return Source(f"camera {source}", _camera(source), None, waits=False)
    if source == "-":
        if sys.stdin is None:
            raise InputError(
                "not-reached", "Expected a video from standard input, but it is closed; pipe one into it."
            )
        # Unbuffered: what is in the pipe is taken, and nothing more is waited for.
        pipe = open(sys.stdin.fileno(), "rb", buffering=0, closefd=False)  # noqa: SIM115 (stdin stays open)
        # By `< FILE`, which has all of its images at once.
        is_file = stat.S_ISREG(os.fstat(pipe.fileno()).st_mode)
        return Source("pipe", _stream(pipe, "the pipe", "pipe"), None, waits=is_file)
    protocol, colon, _ = source.partition("://")
    if colon:
        if protocol not in _PROTOCOLS:
            raise InputError(
                "unsafe",
                f"Expected a stream by one of {', '.join(_PROTOCOLS)}, got '{protocol}'; give a file by its path.",
            )
        allowed = f"{','.join(_PROTOCOLS)},{_NEEDED}"
        return Source(f"{protocol} stream", _stream(source, source, allowed), None, waits=False)
    video = read_video(Path(source))
    shots = (
        Shot(number, float(video.time_s[number]), np.ascontiguousarray(image))
        for number, image in images_from(video)
    )
    return Source(video.path.name, shots, video, waits=True)


def _stream(source: str | FileIO, name: str, protocols: str) -> Iterator[Shot]:
    import av
    from av.error import FFmpegError

    try:
        with av.open(
            source,
            "r",
            metadata_errors="ignore",
            options={"protocol_whitelist": protocols, "format_whitelist": f"{CONTAINERS},{_STREAMS}"},
        ) as container:
            if not container.streams.video:
                raise InputError(
                    "format-unknown", f"Expected a video from {name}, but it has no video stream."
                )
            stream = container.streams.video[0]
            # Threads by frame would hold some back.
            stream.thread_type, stream.codec_context.thread_count = "SLICE", cores()
            start: float | None = None
            last: float | None = None
            for number, frame in enumerate(container.decode(stream)):
                now = frame.time
                if now is None:
                    now = 0.0 if last is None else last + 1 / float(stream.average_rate or 30)
                if last is not None and now <= last:
                    raise InputError(
                        "times-broken",
                        f"Expected from {name} each image later than the one before, got one at {now:.3f} s after "
                        f"one at {last:.3f} s; begin again for what follows.",
                    )
                start, last = now if start is None else start, now
                image = np.rot90(frame.to_ndarray(format="rgb24", threads=1), round(frame.rotation / 90))
                yield Shot(number, now - start, np.ascontiguousarray(image))
    except FFmpegError as error:
        raise InputError(
            "not-reached", f"Expected a video from {name}, but it cannot be read: {error.strerror}."
        ) from None


def _camera(source: str) -> Iterator[Shot]:
    import cv2

    camera: Any = cv2.VideoCapture(int(source) if source.isdigit() else source)
    try:
        if not camera.isOpened():
            raise InputError(
                "not-reached",
                f"There is no camera {source}, or another program uses it; the first camera has number 0.",
            )
        start, number = None, 0
        while True:
            there, image = camera.read()
            if not there:
                raise InputError(
                    "not-reached", f"The camera {source} gives no more images; is it still connected?"
                )
            now = time.perf_counter()  # whose steps are finer than those of monotonic on Windows
            start = now if start is None else start
            yield Shot(number, now - start, np.ascontiguousarray(image[..., ::-1]))
            number += 1
    finally:
        camera.release()


class Incoming:
    """A source's shots, read in a thread of their own: each of a source that waits, else always the newest, numbered
    anew unless they are of a video file. dropped: how many came while nobody asked. broke: what ended a source that had
    given images before."""

    def __init__(self, source: Source) -> None:
        self.dropped = 0
        self.broke: InputError | None = None
        self._source = source
        self._slot: deque[Shot] = deque(maxlen=1)
        self._error: BaseException | None = None
        self._news = threading.Condition()
        self._ended = False
        self._given = 0

    def until(self, stop: Callable[[], bool]) -> Iterator[Shot]:
        """Shots as they come, until the source ends or `stop` says so, which is asked several times a second.

        InputError when the source gives nothing; one that breaks later has ended, for what came before is not lost.
        """
        threading.Thread(target=self._read, daemon=True).start()
        try:
            yield from self._shots(stop)
        finally:  # also where nobody asks for more
            self._end()
        if self._error is not None:
            if not (self._given and isinstance(self._error, InputError)):
                raise self._error
            self.broke = self._error

    def _shots(self, stop: Callable[[], bool]) -> Iterator[Shot]:
        while True:
            with self._news:
                while not (self._slot or self._ended or stop()):
                    self._news.wait(_ASK_S)
                if stop() or not self._slot:
                    return
                shot = self._slot.pop()
                self._news.notify_all()
            if self._source.waits:
                shot = replace(shot, came_s=time.perf_counter())
            elif self._source.video is None:
                shot = replace(shot, number=self._given)
            self._given += 1
            yield shot

    def _end(self) -> None:
        with self._news:
            self._ended = True
            self._news.notify_all()

    def _read(self) -> None:
        try:
            for shot in self._source.shots:
                with self._news:
                    if self._source.waits:
                        self._news.wait_for(lambda: not self._slot or self._ended)
                    if self._ended:
                        return
                    self.dropped += len(self._slot)
                    self._slot.append(shot)
                    self._news.notify_all()
        except BaseException as error:
            self._error = error
        self._end()
