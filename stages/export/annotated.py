"""annotated.mp4: the run's video with 2D keypoints and the horizon; beside it the rectified skeleton and its angles."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...pipeline.core.camera import Camera
from ...pipeline.core.errors import InputError
from ...pipeline.core.intrinsics import undistorted, undistorted_image
from ...pipeline.core.messages import how_many
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate
from ...pipeline.core.take import Take, Video
from ...pipeline.files.atomic import whole_file
from ...pipeline.files.video_frames import images_ahead
from ...pipeline.signals.angles import sides_of
from ...pipeline.signals.visibility import LEAST_SCORE
from ..drawing.facts import angle_bands
from ..drawing.image_lines import FIXED, WHITE, draw_bones, fixed, horizon
from ..drawing.palette import DARK, Colour, faint, side_colour
from ..drawing.rerun_video import TICK, h264_stream

_MOST, _LEAST_HEIGHT, _ENLARGED = (1280, 720), 480, 2.0  # pixels of the video's part; small ones are enlarged
_PALE: Colour = (235, 235, 235)
_GROUND = 0.8  # share of its side's colour under a number, which is pale
_ANGLES = {"knee_flexion": "knee", "elbow_flexion": "elbow", "trunk_lean_sagittal": "trunk"}


def write_annotated(take: Take, path: Path) -> tuple[Notice, ...]:
    """The video's frames from the first to the last of the poses as H.264, each at its own time stamp, so that a
    variable frame rate stays what it is; sound is left out.

    On the image: the 2D keypoints that were seen, and the horizon by the take's up, where it is levelled and the
    camera's focal length known or assumed. Images of a calibrated camera are shown without its distortion. Beside it:
    the skeleton in BODY from the front and from the right, and flexion of knees and elbows and the trunk's lean with
    their 90 % bands; in frames without a pose nothing. InputError for a take without a video, or without a frame of
    it, and where it cannot be decoded or written.
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
    return (notice("file-begins", file=path.name, begin_s=begin_s),)


class _Page:
    """What is drawn around and beside an image of the take's video."""

    def __init__(self, take: Take, video: Video) -> None:
        width, height = video.size
        larger = min(_ENLARGED, max(1.0, _LEAST_HEIGHT / height))
        self.scale = min(larger, _MOST[0] / width, _MOST[1] / height)
        self.image_size = _even(width * self.scale), _even(height * self.scale)
        side = _even(self.image_size[1] / 2)  # of each view
        self.size = self.image_size[0] + 2 * side, self.image_size[1]
        self.camera = take.camera
        self.body = take.need("rectified").body
        self.rows = _by_frame(self.body)
        self.angles = {name: band for name in _ANGLES if (band := angle_bands(take, name)) is not None}
        self.thick = max(1, round(self.image_size[1] / 240))
        self.line = 14 + 4 * self.thick
        below = (len(self.angles) + 2) * self.line
        self.views = _views(self.body, side, self.size[1] - below)
        # (T, 3) in CAMERA axes; NaN where the take is not levelled or the poses are not a camera's.
        rectified, frame = take.need("rectified"), take.need("poses").frame
        self.up = np.full((len(self.body), 3), np.nan)
        if frame.family == "camera" and rectified.level_ok:
            self.up[:] = rotate(frame.basis.T, np.atleast_2d(rectified.R_source_from_level[..., 2]))
        # On those that the detector has not seen nothing rests.
        keypoints = take.keypoints
        self.keypoints = keypoints and keypoints.without(keypoints.confidence < LEAST_SCORE)
        self.keypoint_rows = _by_frame(self.keypoints) if self.keypoints is not None else {}

    def drawn(self, number: int, image: np.ndarray) -> np.ndarray:
        """(H, W, 3) RGB of a frame's image."""
        import cv2

        intrinsics = self.camera.intrinsics if self.camera else None
        small = cv2.resize(
            undistorted_image(image, intrinsics), self.image_size, interpolation=cv2.INTER_AREA
        )
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
        for colour, width in ((DARK, 3), (WHITE, 1)):
            cv2.line(small, fixed(start), fixed(end), colour, width, cv2.LINE_AA, FIXED)
        text = "horizon" + (" (focal length assumed)" if camera.focal_source == "prior" else "")
        _write(small, text, (start[0] + 8, start[1] + 12 + 8 * self.thick), self.thick)

    def _draw_keypoints(self, small: np.ndarray, keypoints: PoseSequence, row: int) -> None:
        import cv2

        points = keypoints.joints[row]
        if self.camera is not None and self.camera.intrinsics is not None:
            points = undistorted(points, self.camera.intrinsics)
        at = self._on_small(points)
        draw_bones(small, at, keypoints.layout, self.thick)
        for name, point in zip(keypoints.layout.joints, at, strict=True):
            if is_finite(point):
                place, radius = fixed(point), 3 * self.thick << FIXED
                cv2.circle(small, place, radius, side_colour(name), -1, cv2.LINE_AA, FIXED)
                cv2.circle(small, place, radius, _PALE, max(1, self.thick // 2), cv2.LINE_AA, FIXED)

    def _on_small(self, pixels: np.ndarray) -> np.ndarray:
        """Pixels (..., 2) of the video, whose centres are whole numbers, in the smaller image."""
        return (pixels + 0.5) * self.scale - 0.5

    def _panel(self, number: int, row: int | None) -> np.ndarray:
        """The two views of the skeleton, the angles, and the time."""
        height, width = self.size[1], self.size[0] - self.image_size[0]
        panel, line = np.full((height, width, 3), DARK, np.uint8), self.line
        for i, (name, places) in enumerate(self.views.items()):
            left = i * width // len(self.views)
            _write(panel, name, (left + 8, line), self.thick)
            if row is not None:
                draw_bones(panel, places[row] + (left, 0), self.body.layout, 3 * self.thick)
        bottom = height - 8 - (len(self.angles) + 1) * line
        if row is not None and self.angles:
            _write(panel, "degrees, +/- half the 90 % band", (8, bottom), self.thick)
            for name, (values, bands) in self.angles.items():
                bottom += line
                _write(panel, _ANGLES[name], (8, bottom), self.thick)
                for i, (part, value, band) in enumerate(
                    zip(sides_of(name), values[row], bands[row], strict=True)
                ):
                    place, ground = (width * (1 + i) // 3, bottom), faint(side_colour(part), _GROUND)
                    known = f"{band:.0f}" if np.isfinite(band) else "?"
                    text = "-" if np.isnan(value) else f"{value:z.0f} +/- {known}"
                    _write(panel, text, place, self.thick, ground)
        at = f"{self.body.times[row]:.2f} s" if row is not None else "no pose"
        _write(panel, f"{at}, frame {number}", (8, height - 8), self.thick)
        return panel


def _views(body: PoseSequence, width: int, height: int) -> dict[str, np.ndarray]:
    """By the name of a view, pixels (T, J, 2) of the body's joints in its part of the panel; all at one scale, in which
    the whole take's body fits into so many pixels. From the front the person's right is on the left; from the right the
    face looks right."""
    back, right, up = np.moveaxis(body.joints, -1, 0)
    views = {
        "from the front": np.stack([-right, up], axis=-1),
        "from the right": np.stack([-back, up], axis=-1),
    }
    reach = {name: _range(points) for name, points in views.items()}
    scale = 0.9 * min(float(np.min((width, height) / (high - low))) for low, high in reach.values())
    return {
        name: (points - sum(reach[name]) / 2) * (scale, -scale) + (width / 2, 0.52 * height)
        for name, points in views.items()
    }


def _range(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest (2,) of points (T, J, 2), but for outliers; a unit square of none."""
    shown = points[is_finite(points)]
    if not len(shown):
        return np.zeros(2), np.ones(2)
    low, high = np.percentile(shown, [0.2, 99.8], axis=0)
    return low, np.maximum(high, low + 1e-6)


def _by_frame(poses: PoseSequence) -> dict[int, int]:
    return {int(frame): row for row, frame in enumerate(poses.frame_index)}


def _write(image: np.ndarray, text: str, at: Sequence[float], thick: int, ground: Colour = DARK) -> None:
    import cv2

    place, font, size = (round(at[0]), round(at[1])), cv2.FONT_HERSHEY_SIMPLEX, 0.15 + 0.15 * thick
    (width, height), below = cv2.getTextSize(text, font, size, max(1, thick // 2))
    corners = (place[0] - 3, place[1] - height - 3), (place[0] + width + 3, place[1] + below)
    cv2.rectangle(image, *corners, ground, -1)
    cv2.putText(image, text, place, font, size, _PALE, max(1, thick // 2), cv2.LINE_AA)


def _even(length: float) -> int:
    """Pixels as H.264 needs them: at least two, and even."""
    return max(2, 2 * round(length / 2))
