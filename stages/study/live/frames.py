"""Where live images come from, a camera, or a video file, whose images wait; and how they become poses one by one: the
person is found, followed, lifted and rectified by the frames so far."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import numpy as np

from ....models.detector.load import load_detector
from ....models.detector.protocols import Detector, Found
from ....models.detector.video import Search
from ....models.gravity.evidence import Evidence, fuse, told_up
from ....models.gravity.levelling import camera_frame
from ....models.gravity.live import LiveRectifier
from ....models.lifter.builtin import LiveLifter
from ....pipeline.core.errors import InputError
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.core.take import Told, Video
from ....pipeline.files.atomic import plain
from ....pipeline.files.video_frames import images_ahead
from ....pipeline.reading.load import read_video

_ASK_S = 0.1
_LOST = 30  # frames without the person who is shown, after which another may be
_DIGITS = 6  # decimals in JSON: microseconds


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


@dataclass(frozen=True, eq=False)
class LivePose:
    """One frame of `live_frames`, by what was known at its time. NaN where something is missing or unknown.

    frame: its number, of a video file the file's, else counted from 0 without the dropped ones. time_s: of its capture,
    from the first image. captured_s: the same in seconds since 1970, by this machine's clock. person: the number that
    the person goes by; None, and all joints NaN, in a frame without the person.
    body, level: (17, 3) joints, H36M17, from the pelvis, in BODY and LEVEL: x back, y right, z up, the unit about the
    metres of a person 1.7 m tall. In BODY the person always faces -x, in LEVEL only where the person faces the camera.
    R_camera_from_body, R_camera_from_level: (3, 3). error_deg: expected error of R_camera_from_body. up: (3,) unit, in
    CAMERA. up_bound_deg: it is off by no more in 90 % of takes. Both rest on all frames so far, so LEVEL settles in the
    first seconds.
    latency_ms: from the capture until this pose was there. dropped: images so far that came too fast and were left out.
    """

    frame: int
    time_s: float
    captured_s: float
    person: int | None
    body: np.ndarray
    level: np.ndarray
    R_camera_from_body: np.ndarray
    R_camera_from_level: np.ndarray
    error_deg: float
    up: np.ndarray
    up_bound_deg: float
    latency_ms: float
    dropped: int

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON by the same names; joints by name, None for NaN."""
        of_pose = {name: value for name, value in vars(self).items() if value is not None}
        content = plain({name: np.round(value, _DIGITS).tolist() for name, value in of_pose.items()})
        joints = {name: dict(zip(H36M17.joints, content[name], strict=True)) for name in ("body", "level")}
        return {**content, **joints, "person": self.person}


def live_frames(
    source: str | Path,
    detector: str | Path | Detector = "movenet",
    *,
    person_detector: str | Path | None = None,
    focal_px: float | None = None,
    gravity: tuple[float, float, float] | None = None,
    rectifier: str = "pcnet",
) -> Iterator[LivePose]:
    """The poses of one person from a live source, each as soon as it is there; nothing is written.

    source: a camera's number or device, or a video file. detector, person_detector: names of `pcnet3d list models`,
    .onnx files, or a Detector of your own. focal_px: the camera's focal length. gravity: which way things fall in
    CAMERA (x right, y down, z away), any length, if you know it. rectifier: as of load_rectifier. The person who came
    first is followed. Images that come while one is worked on are dropped, except the newest; those of a file wait.

    InputError for a source, a network or a value that cannot be used, and at the end for a source that broke.
    """
    shown = open_source(str(source))
    if isinstance(detector, str | Path):
        detector = load_detector(detector, person_detector)
    watch = Watch(detector, rectifier, focal_px, told_up(Told(focal_px=focal_px, gravity=gravity)))
    for shot in shown.until(lambda: False):
        yield watch.see(shot, shown.dropped)
    if shown.broke is not None:
        raise shown.broke


@dataclass(eq=False)
class Watch:
    """One person followed through the images of a source.

    rectifier: as of load_rectifier. told_up: what the user says about up, which nothing contradicts while the camera
    runs. search: everybody who was found. size: the image's width and height. person: who is followed. latency_ms:
    from capture to pose, of every frame so far.
    """

    detector: Detector
    rectifier: str
    focal_px: float | None
    told_up: Sequence[Evidence]
    size: tuple[int, int] = (0, 0)
    latency_ms: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.search, self.person = Search(self.detector), Followed()
        self._estimators: tuple[LiveLifter, LiveRectifier] | None = None
        self.for_camera((1, 1))  # loads the networks, so that the first images need not wait

    def for_camera(self, image_size: tuple[int, int]) -> tuple[LiveLifter, LiveRectifier]:
        """Of a camera, or of another one behind a cut."""
        return self.for_person(image_size), LiveRectifier(self.rectifier, self.told_up, check="off")

    def for_person(self, image_size: tuple[int, int]) -> LiveLifter:
        """Of another person: the lift of one rests on no keypoints of another. It may rest on an up that is told."""
        up = fuse(self.told_up).up if self.told_up else None
        return LiveLifter(self.detector.layout, image_size, self.focal_px, up=up)

    def see(self, shot: Shot, dropped: int) -> LivePose:
        """The pose in the next image. dropped: how many images were, so far."""
        search, person = self.search, self.person
        cuts, before = len(search.cuts), person.name
        visible = person.choose(shot.number, search.look(shot.number, shot.time_s, shot.image))
        if self._estimators is None or len(search.cuts) > cuts:
            height, width = shot.image.shape[:2]
            self.size = width, height
            self._estimators = self.for_camera(self.size)
        elif before not in (None, person.name):
            self._estimators = self.for_person(self.size), self._estimators[1]
        lifter, rectifier = self._estimators
        missing = np.full((len(self.detector.layout), 2), np.nan)
        xy, score = (missing, missing[:, 0]) if visible is None else (visible.xy, visible.score)
        joints = lifter.update(xy, score, shot.time_s)
        live = rectifier.update(joints, shot.time_s)
        R_camera_from_level = camera_frame(live.up)
        body, level = (rotate(transpose(R), joints) for R in (live.R_camera_from_body, R_camera_from_level))
        now_s = time.perf_counter()
        self.latency_ms.append(1000 * (now_s - shot.came_s))
        return LivePose(
            frame=shot.number,
            time_s=shot.time_s,
            captured_s=time.time() - (now_s - shot.came_s),
            person=None if visible is None else person.name,
            body=body,
            level=level,
            R_camera_from_body=live.R_camera_from_body,
            R_camera_from_level=R_camera_from_level,
            error_deg=live.error_deg,
            up=live.up,
            up_bound_deg=live.up_bound_deg,
            latency_ms=self.latency_ms[-1],
            dropped=dropped,
        )


@dataclass
class Followed:
    """Who is shown: the first who came, until not seen for _LOST frames; then the largest."""

    name: int | None = None
    last: int = 0
    shown: Counter[int] = field(default_factory=Counter)

    def choose(self, number: int, people: Sequence[tuple[int, Found]]) -> Found | None:
        """The one of a frame's people, by their names."""
        named = dict(people)
        if self.name not in named and (self.name is None or number - self.last > _LOST) and named:
            self.name = max(named, key=lambda name: float(np.prod(named[name].box[2:] - named[name].box[:2])))
        if self.name is None or self.name not in named:
            return None
        self.last = number
        self.shown[self.name] += 1
        return named[self.name]
