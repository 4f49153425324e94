"""Where live images come from: a camera, or a video file, whose images wait."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.take import Video
from ....pipeline.files.video_frames import images_ahead
from ....pipeline.reading.load import read_video

_ASK_S = 0.1


@dataclass(frozen=True, eq=False)
class Shot:
    """number: from 0, of the images that were not dropped; of a file its frame number. time_s: from the first one.
    image: (H, W, 3) uint8 RGB, upright. came_s: when the image was there, by time.perf_counter."""

    number: int
    time_s: float
    image: np.ndarray
    came_s: float = field(default_factory=time.perf_counter)


@dataclass(eq=False)
class Source:
    """name: in words. video: the file, where it is one. waits: whether images wait for who takes them: those of a file
    do; of another source it is always the newest, numbered anew. dropped: how many came while nobody asked. broke: what
    ended a source that had given images before."""

    name: str
    shots: Generator[Shot]
    video: Video | None
    waits: bool
    dropped: int = 0
    broke: InputError | None = None

    def until(self, stop: Callable[[], bool]) -> Iterator[Shot]:
        """Shots as they come, until the source ends or `stop` says so, which is asked several times a second.

        InputError when the source gives nothing; one that breaks later has ended, for what came before is not lost.
        """
        given = 0
        try:
            for shot in self.shots if self.waits else self._newest(stop):
                if stop():
                    return
                given += 1
                yield shot
        except InputError as error:
            if not given:
                raise
            self.broke = error

    def _newest(self, stop: Callable[[], bool]) -> Iterator[Shot]:
        """What a thread of its own reads; the last one, too, is given before the source's end or its error."""
        waiting = Queue[Shot | BaseException | None](1)
        over = threading.Event()

        def read() -> None:
            end: BaseException | None = None
            try:
                with closing(self.shots) as shots:
                    for shot in shots:
                        if over.is_set():
                            return
                        with suppress(Empty):
                            waiting.get_nowait()
                            self.dropped += 1
                        waiting.put(shot)
            except BaseException as error:
                end = error
            waiting.put(end)

        threading.Thread(target=read, daemon=True).start()
        number = 0
        try:
            while not stop():
                try:
                    shot = waiting.get(timeout=_ASK_S)
                except Empty:
                    continue
                if shot is None:
                    return
                if isinstance(shot, BaseException):
                    raise shot
                yield replace(shot, number=number)
                number += 1
        finally:  # also where nobody asks for more
            over.set()


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
        for number, image in images_ahead(video)
    )
    return Source(video.path.name, shots, video, waits=True)


def _camera(source: str) -> Generator[Shot]:
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
