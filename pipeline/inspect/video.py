"""What a run would find in a video, or in one image, before it looks at anybody."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.camera import pitch_roll_deg
from ..core.errors import InputError, readable
from ..core.messages import how_many, rate_in_words
from ..core.take import Take
from ..plugins import registry
from ..reading.bounds import rate_doubts
from ..reading.load import read_video

_FOCAL_BY = {"told": "as told", "file": "by the video file", "lines": "by the lines", "prior": "a guess"}


@dataclass(frozen=True, eq=False)
class InspectedImages:
    """A video or an image, and what the stage `calibrate` says about its camera."""

    path: Path
    take: Take

    def figures(self) -> dict[str, Any]:
        """Plain values; None where unknown."""
        camera = self.take.need("camera")
        width, height = camera.image_size
        values: dict[str, Any] = {"file": str(self.path), "width": width, "height": height}
        if (video := self.take.video) is not None:
            values |= {
                "codec": video.codec, "rotation_deg": video.rotation_deg, "frames": len(video.time_s),
                "fps": video.fps, "capture_fps": video.capture_fps,
                "duration_s": float(video.time_s[-1] + np.nan_to_num(1 / video.fps)),
            }  # fmt: skip
        pitch, roll, error = None, None, None
        if camera.looks:
            look = camera.looks[0]
            pitch, roll = pitch_roll_deg(look.up).tolist()
            error = look.error_deg
        return values | {
            "pitch_deg": pitch, "roll_deg": roll, "up_error_deg": error, "reason": camera.reason or None,
            "focal_px": camera.focal_px, "focal_sd_px": camera.focal_sd_px, "focal_source": camera.focal_source,
        }  # fmt: skip

    def __str__(self) -> str:
        take, values, video = self.take, self.figures(), self.take.video
        size = f"{values['width']} x {values['height']} pixels"
        lines = [f"{self.path}: image, {size}"]
        if video is not None:
            turned = f", turned by {video.rotation_deg} degrees" if video.rotation_deg else ""
            rate = rate_in_words(video.fps, ", ")
            lines = [
                f"{self.path}: video, {video.codec}, {size}{turned}",
                f"{how_many(values['frames'], 'frame')}{rate}, {values['duration_s']:.1f} s",
                *(each.text for each in (*video.doubts, *rate_doubts(None, video))),
            ]
        has_up = values["pitch_deg"] is not None
        return "\n".join([
            *lines,
            f"pitch {values['pitch_deg']:.1f} and roll {values['roll_deg']:.1f} degrees, standard deviation of up "
            f"{values['up_error_deg']:.1f}" if has_up else f"pitch and roll are not known: {values['reason']}",
            *(each.text for each in take.notices),
            f"focal length {values['focal_px']:.0f} pixels, standard deviation {values['focal_sd_px']:.0f}, "
            f"{_FOCAL_BY[values['focal_source']]}",
        ])  # fmt: skip


def inspect_video(path: Path) -> InspectedImages:
    """A video file's facts and its camera. InputError when it is none, or cannot be read."""
    take = Take(path.name, video=read_video(path))
    return InspectedImages(path, registry.load("stages", "calibrate")()(take))


def inspect_image(path: Path) -> InspectedImages:
    """An image's camera. InputError when it is none, or cannot be read."""
    stage = registry.load("stages", "calibrate")()
    return InspectedImages(path, stage.of_image(path.name, _image(path)))


def is_image(path: Path) -> bool:
    """Whether a file begins like an image that OpenCV reads (PNG, JPEG, WebP, TIFF, BMP and others). Never raises."""
    import cv2

    return path.is_file() and cv2.haveImageReader(str(path))


def _image(path: Path) -> np.ndarray:
    """(H, W, 3) uint8 RGB. InputError when it is no image."""
    import cv2

    with readable(path, "an image"):
        content = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    if image is None:
        raise InputError(
            "file-damaged", f"Expected an image (PNG, JPEG, ...) in {path}; it cannot be decoded."
        )
    return np.ascontiguousarray(image[:, :, ::-1])
