"""The images of a video, as players show them, one after the other; however long it is, a few are held at a time."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..core.errors import InputError
from ..core.system import cores
from ..core.take import Video

if TYPE_CHECKING:
    from av import VideoFrame
    from av.container import InputContainer

T = TypeVar("T")
_AHEAD = 2  # images that are decoded before they are asked for
_BACK_S = 10.0  # before where a key frame should be, in a file that is searched without an index
# FFmpeg's names of those that adapters/video.py recognises.
CONTAINERS = "mov,matroska,avi,asf,flv,mpeg,mpegts,gif"
_THIS_FILE = {"protocol_whitelist": "file", "format_whitelist": CONTAINERS}
_NO_SEEKING = ("mpeg",)  # MPEG programme streams: behind a seek FFmpeg's stamps are one frame early


def images_from(
    video: Video, first: int = 0, last: float = np.inf, damaged: list[int] | None = None
) -> Generator[tuple[int, np.ndarray]]:
    """(frame number, image) from frame `first` to `last`: (H, W, 3) uint8 RGB, the video's rotation obeyed.

    Numbers count the rows of `video.time_s`; a frame that the decoder leaves out is left out here too. Before `first`
    no more is decoded than lies between it and the key frame before it. damaged: gets the numbers of frames whose data
    the decoder calls corrupt. InputError for a video that cannot be decoded.
    """
    for number, frame in frames_from(video, first):
        if number <= last:
            if frame.is_corrupt and damaged is not None:
                damaged.append(number)
            yield number, _upright(frame, video.rotation_deg)
        if number >= last:
            return


def images_ahead(
    video: Video, first: int = 0, last: float = np.inf, damaged: list[int] | None = None
) -> Iterator[tuple[int, np.ndarray]]:
    """(number, image (H, W, 3) RGB) as `images_from`, the next images decoded in a thread of their own while the
    caller looks at one. InputError as there."""
    with closing(images_from(video, first, last, damaged)) as images, ThreadPoolExecutor(1) as decoder:
        coming = deque(decoder.submit(next, images, None) for _ in range(_AHEAD))
        while (shown := coming.popleft().result()) is not None:
            coming.append(decoder.submit(next, images, None))
            yield shown


def frames_from(video: Video, first: int = 0) -> Iterator[tuple[int, VideoFrame]]:
    """As `images_from`, the frames as they are stored. InputError as there."""
    with _opened(video) as film:
        yield from film.frames_from(first)


def images_at(video: Video, frames: Iterable[int]) -> dict[int, np.ndarray]:
    """{frame number: image}, (H, W, 3) uint8 RGB. InputError as for `images_from`."""
    return OnePass(video).ask(frames, lambda _, image: image)()


class OnePass:
    """Images of a video for several who look at some of them: what all of them asked for is decoded in one pass, when
    the first wants to see it. An image is held only as long as somebody looks at it. Without a video nothing is
    seen."""

    def __init__(self, video: Video | None) -> None:
        self._video = video
        self._waiting: list[_Asked] = []

    def ask(
        self, frames: Iterable[int], look: Callable[[int, np.ndarray], T], grey_side: int | None = None
    ) -> Callable[[], dict[int, T]]:
        """A function that returns {frame number: what `look` made of number and image}; a frame that is not found is
        left out. Images are (H, W, 3) uint8 RGB, or with grey_side (H, W) in grey, brought to that many pixels of the
        longer side. The function raises InputError as `images_from` does."""
        asked = _Asked(set(frames), look, grey_side)
        self._waiting.append(asked)

        def looked() -> dict[int, T]:
            if asked in self._waiting:
                self._look()
            return asked.answers

        return looked

    def _look(self) -> None:
        wanted = sorted(set().union(*(asked.frames for asked in self._waiting)))
        if (video := self._video) is not None:
            for number, frame in _frames_at(video, wanted):
                for asked in (each for each in self._waiting if number in each.frames):
                    image = _upright(frame, video.rotation_deg, asked.grey_side)
                    asked.answers[number] = asked.look(number, image)
        self._waiting.clear()  # not before: who asks again after a failure is to hear of it, too


@dataclass(eq=False)
class _Asked:
    """answers: of `look`, by frame number."""

    frames: set[int]
    look: Callable[[int, np.ndarray], Any]
    grey_side: int | None
    answers: dict[int, Any] = field(default_factory=dict)


def _frames_at(video: Video, frames: Iterable[int]) -> Iterator[tuple[int, VideoFrame]]:
    """Those of these numbers, ascending, that are found."""
    with _opened(video) as film:
        coming: Iterator[tuple[int, VideoFrame]] | None = None
        keys = video.key_frames
        for wanted in frames:
            # Where no key frame lies between, a search would go back to what was decoded.
            if coming is None or bisect_right(keys, film.number) < bisect_right(keys, wanted):
                coming = film.frames_from(wanted)
            for number, frame in coming:
                if number == wanted:
                    yield number, frame
                if number >= wanted:
                    break


@contextmanager
def _opened(video: Video) -> Iterator[_Film]:
    """InputError for a video that cannot be decoded, also while the block runs."""
    from av.error import FFmpegError

    film = None
    try:
        with _container(video) as container:
            film = _Film(video, container)
            yield film
    except FFmpegError as error:
        raise InputError(
            "file-damaged",
            f"The video {video.path} cannot be decoded beyond frame {film.number if film else 0}: {error.strerror}; it "
            "may be damaged: copy it again, or rewrite it with ffmpeg.",
        ) from None


def opened(path: Path) -> InputContainer:
    """A video file, to be closed by who asks. Nothing but this file is opened: no address, and no container that names
    other files or addresses (playlists). av's FFmpegError where it is no such video."""
    import av

    # "file:" in front, or a name with a colon would be taken for an address.
    return av.open(f"file:{path}", metadata_errors="ignore", options=_THIS_FILE)


@contextmanager
def _container(video: Video) -> Iterator[InputContainer]:
    """The file, newly opened, its first moving image decoded by as many threads as there are cores."""
    with opened(video.path) as container:
        stream = container.streams.video[0]
        stream.thread_type, stream.codec_context.thread_count = "AUTO", cores()
        yield container


class _Film:
    """An open video. number: of the last frame that was decoded, also on the way to one that is wanted."""

    def __init__(self, video: Video, container: InputContainer) -> None:
        self.number = 0
        self._video, self._container = video, container
        self._tick = float(container.streams.video[0].time_base or 1)
        # AVI knows no times of showing: FFmpeg's are those of other frames where some are coded ahead (B-frames).
        self._stamp = "dts" if container.format.name == "avi" else "pts"
        stamps = (getattr(frame, self._stamp) for frame in container.decode(video=0))
        start = next((stamp for stamp in stamps if stamp is not None), 0)
        self._stamps = start + np.round(video.time_s / self._tick).astype(np.int64)

    def frames_from(self, first: int) -> Iterator[tuple[int, VideoFrame]]:
        """Frame numbers and frames, from the one numbered `first` on."""
        if first >= len(self._stamps):
            return
        for frame in self._decoded(int(self._stamps[first])):
            stamp = getattr(frame, self._stamp)
            if stamp is None and self._stamp == "dts" and self.number + 1 < len(self._stamps):
                stamp = self._stamps[self.number + 1]  # the last ones, which no packet follows
            if stamp is None:
                continue
            number = int(np.searchsorted(self._stamps, stamp))
            if number < len(self._stamps) and self._stamps[number] == stamp:
                self.number = number
                if number >= first:
                    yield number, frame

    def _decoded(self, stamp: int) -> Iterator[VideoFrame]:
        """The frames from the key frame before `stamp` on, or from an earlier one.

        In a file without an index, such as MPEG-TS, seeking goes by the stamps of decoding, which with B-frames are
        before those of showing, and may land behind that key frame; in some there is no seeking to before the first.
        What seeking does not find is found from the beginning.
        """
        from av.error import FFmpegError

        container, targets = self._container, (stamp, stamp - round(_BACK_S / self._tick))
        for target in () if container.format.name in _NO_SEEKING else targets:
            try:
                container.seek(target, stream=container.streams.video[0], backward=True)
            except FFmpegError:
                continue
            frames = container.decode(video=0)
            landed = next((frame for frame in frames if getattr(frame, self._stamp) is not None), None)
            if landed is not None and getattr(landed, self._stamp) <= stamp:
                yield landed
                yield from frames
                return
        with _container(self._video) as again:
            yield from again.decode(video=0)


def _upright(frame: VideoFrame, rotation_deg: int, grey_side: int | None = None) -> np.ndarray:
    # Starting threads for each frame costs more than they save.
    if grey_side is None:
        image = frame.to_ndarray(format="rgb24", threads=1)
    else:
        scale = grey_side / max(frame.width, frame.height)
        width, height = (max(round(side * scale), 16) for side in (frame.width, frame.height))
        image = frame.to_ndarray(width=width, height=height, format="gray", interpolation="AREA", threads=1)
    return np.ascontiguousarray(np.rot90(image, -rotation_deg // 90))
