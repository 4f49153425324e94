"""Where live images come from: a camera, or a video file, whose images wait."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.take import Video
from ....pipeline.files.video_frames import images_from
from ....pipeline.reading.load import read_video

_ASK_S = 0.1


@dataclass(frozen=True, eq=False)
class Shot:
    """number: from 0, of the images that were not dropped; of a file its frame number. time_s: from the first one.
    image: (H, W, 3) uint8 RGB, upright. came_s: when the image was there, by time.perf_counter; of one that waits, when
    it was taken."""

    number: int
    time_s: float
    image: np.ndarray
    came_s: float = field(default_factory=time.perf_counter)


@dataclass(frozen=True, eq=False)
class Source:
    """name: in words. video: the file, where it is one. waits: whether images wait for who takes them: those of a file
    do."""

    name: str
    shots: Iterator[Shot]
    video: Video | None
    waits: bool


def open_source(source: str) -> Source:
    """A camera by its number or device, or a video file. InputError when it cannot be opened, or later when it
    breaks."""
    if source.isdigit() or Path(source).is_char_device():
        return Source(f"camera {source}", _camera(source), None, waits=False)
    if source == "-" or "://" in source:
        raise InputError(
            "unsafe",
            f"Expected the number or device of a camera, or a video file, got '{source}'; live opens no address and no "
            "pipe: record the stream with another program (ffmpeg -i ADDRESS FILE), and give the file.",
        )
    video = read_video(Path(source))
    shots = (
        Shot(number, float(video.time_s[number]), np.ascontiguousarray(image))
        for number, image in images_from(video)
    )
    return Source(video.path.name, shots, video, waits=True)


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
