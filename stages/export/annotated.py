"""annotated.mp4: the run's video with 2D keypoints and the horizon, and the rectified skeleton beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...pipeline.core.camera import Camera
from ...pipeline.core.errors import InputError
from ...pipeline.core.intrinsics import undistorted
from ...pipeline.core.layouts import Layout, with_feet
from ...pipeline.core.messages import how_many
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate
from ...pipeline.core.take import Take, Video
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.video_frames import images_ahead, shown_size
from ...pipeline.signals.visibility import LEAST_SCORE
from ..drawing.facts import up_of_camera
from ..drawing.image_lines import HORIZON, horizon, ideal
from ..drawing.palette import Colour, side_colour
from ..drawing.rerun_video import TICK, h264_stream

_MOST = (1280, 720)  # pixels of the video's part
_DARK: Colour = (28, 30, 34)
_PALE: Colour = (235, 235, 235)
_FIXED = 4  # bits of a pixel's fraction, as OpenCV draws
# What is to the right, up and near there, in BODY (back, right, up).
_SIDES = {
    "from the front": ((0, -1.0, 0), (0, 0, 1.0), (-1.0, 0, 0)),
    "from the right": ((-1.0, 0, 0), (0, 0, 1.0), (0, 1.0, 0)),
}


def check_h264() -> None:
    """InputError where the installed PyAV cannot write H.264."""
    from av.codec import Codec

    try:
        Codec("libx264", "w")
    except ValueError:
        raise InputError(
            "needs-package",
            "MP4 needs an FFmpeg that writes H.264, and the installed PyAV has none; install PyAV's own wheel: "
            "pip install --force-reinstall av.",
        ) from None


def write_annotated(take: Take, path: Path) -> tuple[Notice, ...]:
    """The video's frames from the first to the last of the poses as H.264, each at its own time stamp, so that a
    variable frame rate stays what it is; sound is left out.

    On the image: the 2D keypoints, each a ring that is filled as far as the detector is sure of it, and the horizon by
    the take's up, where it is levelled and the camera's focal length known or assumed. Images of a calibrated camera
    are shown without its distortion. Beside it: the skeleton in BODY from the front and from the right; in frames
    without a pose nothing. InputError for a take without a video, or without a frame of it, and where it cannot be
    decoded or written.
    """
    import av
    from av.error import FFmpegError

    if take.video is None:
        raise InputError(
            "needs-input", "MP4 annotates the video of the run, and this one has none; give the video too."
        )
    video, body = take.video, take.need("rectified").body
    first, last = int(body.frame_index[0]), min(int(body.frame_index[-1]), len(video.time_s) - 1)
    if first > last:
        raise InputError(
            "files-apart",
            f"Expected poses of a video of {how_many(len(video.time_s), 'frame')}, got them from frame {first} on; "
            "give the video that they are of.",
        )
    page = _Page(take, video)
    try:
        with whole_file(path) as partial, av.open(str(partial), "w", format="mp4") as target:
            encoder = h264_stream(target, *page.size, video.fps)
            for number, image in images_ahead(video, first, last):
                frame = av.VideoFrame.from_ndarray(page.drawn(number, image), format="rgb24")
                frame = frame.reformat(format="yuv420p", threads=1)
                frame.time_base = TICK
                frame.pts = round((video.time_s[number] - video.time_s[first]) / float(TICK))
                target.mux(encoder.encode(frame))
            target.mux(encoder.encode(None))
    except FFmpegError as error:
        raise InputError(
            "cannot-write", f"The video {path} could not be written: {error.strerror}."
        ) from None
    if first == 0:
        return ()
    begin_s = float(video.time_s[first])
    return (notice("annotated-begins", file=path.name, frame=first, begin_s=begin_s),)


class _Page:
    """What is drawn around and beside an image of the take's video."""

    def __init__(self, take: Take, video: Video) -> None:
        width, height = shown_size(video)
        self.scale = min(1.0, _MOST[0] / width, _MOST[1] / height)
        self.image_size = _even(width * self.scale), _even(height * self.scale)
        side = _even(self.image_size[1] / 2)
        self.size = self.image_size[0] + side, self.image_size[1]
        self.camera = take.camera
        self.body = with_feet(take.need("rectified").body)
        self.rows = _by_frame(self.body)
        self.views = _views(self.body, side)
        self.up = up_of_camera(take)
        self.keypoints = take.keypoints
        self.keypoint_rows = _by_frame(take.keypoints) if take.keypoints is not None else {}
        self.thick = max(1, round(self.image_size[1] / 240))

    def drawn(self, number: int, image: np.ndarray) -> np.ndarray:
        """(H, W, 3) RGB of a frame's image."""
        import cv2

        intrinsics = self.camera.intrinsics if self.camera else None
        small = cv2.resize(ideal(image, intrinsics), self.image_size, interpolation=cv2.INTER_AREA)
        row = self.rows.get(number)
        if self.camera is not None and row is not None and np.isfinite(self.up[row]).all():
            self._draw_horizon(small, self.camera, self.up[row])
        if self.keypoints is not None and number in self.keypoint_rows:
            self._draw_keypoints(small, self.keypoints, self.keypoint_rows[number])
        return np.ascontiguousarray(np.concatenate([small, self._panel(number, row)], axis=1))

    def _draw_horizon(self, small: np.ndarray, camera: Camera, up: np.ndarray) -> None:
        import cv2

        edge = horizon(camera, up)
        if edge is None:
            return
        start, end = sorted(self._on_small(edge).tolist())
        for colour, width in ((_DARK, self.thick + 2), (HORIZON, self.thick)):
            cv2.line(small, _fixed(start), _fixed(end), colour, width, cv2.LINE_AA, _FIXED)
        words = "horizon" + (" (focal length assumed)" if camera.focal_source == "prior" else "")
        _write(small, words, (start[0] + 8, start[1] + 12 + 8 * self.thick), self.thick)

    def _draw_keypoints(self, small: np.ndarray, keypoints: PoseSequence, row: int) -> None:
        import cv2

        points = keypoints.joints[row]
        if self.camera is not None and self.camera.intrinsics is not None:
            points = undistorted(points, self.camera.intrinsics)
        at = self._on_small(points)
        unseen = keypoints.confidence[row] < LEAST_SCORE  # for a while so, nothing rests on it
        _draw_bones(small, np.where(unseen[:, None], np.nan, at), keypoints.layout, self.thick)
        radius = 3.0 * self.thick
        for name, point, sure in zip(keypoints.layout.joints, at, keypoints.confidence[row], strict=True):
            if not is_finite(point):
                continue
            filled = radius * np.sqrt(1.0 if np.isnan(sure) else sure)
            cv2.circle(small, _fixed(point), _unit(filled), side_colour(name), -1, cv2.LINE_AA, _FIXED)
            cv2.circle(
                small, _fixed(point), _unit(radius), _PALE, max(1, self.thick // 2), cv2.LINE_AA, _FIXED
            )

    def _on_small(self, pixels: np.ndarray) -> np.ndarray:
        """Pixels (..., 2) of the video, whose centres are whole numbers, in the smaller image."""
        return (pixels + 0.5) * self.scale - 0.5

    def _panel(self, number: int, row: int | None) -> np.ndarray:
        """The two views of the skeleton, and the time."""
        height, width = self.size[1], self.size[0] - self.image_size[0]
        panel = np.full((height, width, 3), _DARK, np.uint8)
        for i, view in enumerate(self.views):
            top = i * height // 2
            _write(panel, view.name, (8, top + 14 + 4 * self.thick), self.thick)
            if row is not None:
                _draw_bones(
                    panel, view.places[row] + (0, top), self.body.layout, 2 * self.thick, view.near[row]
                )
        at = f"{self.body.times[row]:.2f} s" if row is not None else "no pose"
        _write(panel, f"{at}, frame {number}", (8, height - 8), self.thick)
        return panel


@dataclass(frozen=True, eq=False)
class _View:
    """places: (T, J, 2) pixels of the body's joints in its part of the panel. near: (T, J) how near they are."""

    name: str
    places: np.ndarray
    near: np.ndarray


def _views(body: PoseSequence, side: int) -> list[_View]:
    """All at one scale, in which the whole take's body fits into a square of `side` pixels."""
    seen = {name: rotate(np.array(axes), body.joints) for name, axes in _SIDES.items()}
    reach = {name: _range(points[..., :2]) for name, points in seen.items()}
    scale = 0.76 * side / max(float(np.max(high - low)) for low, high in reach.values())
    return [
        _View(
            name,
            (points[..., :2] - (low + high) / 2) * (scale, -scale) + (side / 2, 0.52 * side),
            points[..., 2],
        )
        for name, points in seen.items()
        for low, high in [reach[name]]
    ]


def _range(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest (2,) of points (T, J, 2), but for outliers; a unit square of none."""
    seen = points[is_finite(points)]
    if not len(seen):
        return np.zeros(2), np.ones(2)
    low, high = np.percentile(seen, [0.2, 99.8], axis=0)
    return low, np.maximum(high, low + 1e-6)


def _by_frame(poses: PoseSequence) -> dict[int, int]:
    return {int(frame): row for row, frame in enumerate(poses.frame_index)}


def _draw_bones(
    image: np.ndarray, at: np.ndarray, layout: Layout, thick: int, near: np.ndarray | None = None
) -> None:
    """Lines between points (J, 2) in the colours of sides, the nearest last where it is told how near they are (J,)."""
    import cv2

    bones = layout.bones
    if near is not None:
        bones = sorted(bones, key=lambda bone: float(np.nan_to_num(near[layout.indices(bone)].sum())))
    for bone in bones:
        ends = at[layout.indices(bone)]
        if is_finite(ends).all():
            cv2.line(image, _fixed(ends[0]), _fixed(ends[1]), side_colour(*bone), thick, cv2.LINE_AA, _FIXED)


def _write(image: np.ndarray, text: str, at: Sequence[float], thick: int) -> None:
    import cv2

    place, font, size = (round(at[0]), round(at[1])), cv2.FONT_HERSHEY_SIMPLEX, 0.15 + 0.15 * thick
    wide = max(1, thick // 2)
    (width, height), below = cv2.getTextSize(text, font, size, wide)
    corners = (place[0] - 3, place[1] - height - 3), (place[0] + width + 3, place[1] + below)
    cv2.rectangle(image, *corners, _DARK, -1)
    cv2.putText(image, text, place, font, size, _PALE, wide, cv2.LINE_AA)


def _fixed(point: Sequence[float] | np.ndarray) -> tuple[int, int]:
    return _unit(point[0]), _unit(point[1])


def _unit(value: float) -> int:
    return round(float(value) * (1 << _FIXED))


def _even(length: float) -> int:
    """Pixels as H.264 needs them: at least two, and even."""
    return max(2, 2 * round(length / 2))
