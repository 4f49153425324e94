"""What a run would find in a video, or in one image, before it looks at anybody."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.camera import Camera, pitch_roll_deg
from ..core.messages import how_many, rate_in_words
from ..core.take import Take, Video
from ..files.images import read_image
from ..files.video_frames import shown_size
from ..plugins import registry
from ..reading.bounds import rate_doubts
from ..reading.load import read_video

AS_IF_FPS = 30.0  # of a folder of images, whose rate only a run has to know
_FOCAL_BY = {"told": "as told", "file": "by the video file", "lines": "by the lines", "prior": "a guess"}


@dataclass(frozen=True, eq=False)
class InspectedVideo:
    """A video, and what the stage `calibrate` says about its camera."""

    take: Take

    @property
    def video(self) -> Video:
        assert self.take.video is not None
        return self.take.video

    def figures(self) -> dict[str, Any]:
        """Plain values; None where unknown."""
        video = self.video
        width, height = shown_size(video)
        timed = not video.images
        return {
            "file": str(video.path), "codec": video.codec, "width": width, "height": height,
            "rotation_deg": video.rotation_deg, "frames": len(video.time_s), "fps": video.fps if timed else None,
            "capture_fps": video.capture_fps,
            "duration_s": float(video.time_s[-1] + np.nan_to_num(1 / video.fps)) if timed else None,
            **_of_camera(self.take),
        }  # fmt: skip

    def __str__(self) -> str:
        values = self.figures()
        turned = f", turned by {values['rotation_deg']} degrees" if values["rotation_deg"] else ""
        frames = how_many(values["frames"], "frame")
        lines = [
            f"{values['file']}: video, {values['codec']}, {values['width']} x {values['height']} pixels{turned}",
            f"{frames}, at the rate that --fps tells a run"
            if self.video.images
            else f"{frames}{rate_in_words(values['fps'], ', ')}, {values['duration_s']:.1f} s",
            *(each.text for each in (*self.video.doubts, *rate_doubts(None, self.video))),
            *_camera_in_words(self.take),
        ]
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class InspectedImage:
    """An image, and what the stage `calibrate` says about its camera."""

    path: Path
    take: Take

    def figures(self) -> dict[str, Any]:
        """Plain values; None where unknown."""
        width, height = self.take.need("camera").image_size
        return {"file": str(self.path), "width": width, "height": height, **_of_camera(self.take)}

    def __str__(self) -> str:
        width, height = self.take.need("camera").image_size
        return "\n".join([f"{self.path}: image, {width} x {height} pixels", *_camera_in_words(self.take)])


def _of_camera(take: Take) -> dict[str, Any]:
    camera: Camera = take.need("camera")
    pitch, roll, error = None, None, None
    if camera.looks:
        look = camera.looks[0]
        pitch, roll = pitch_roll_deg(look.up).tolist()
        error = look.error_deg
    return {
        "pitch_deg": pitch, "roll_deg": roll, "up_error_deg": error, "reason": camera.reason or None,
        "focal_px": camera.focal_px, "focal_sd_px": camera.focal_sd_px, "focal_source": camera.focal_source,
    }  # fmt: skip


def _camera_in_words(take: Take) -> list[str]:
    camera, figures = take.need("camera"), _of_camera(take)
    source, lines = _FOCAL_BY[camera.focal_source], [f"pitch and roll are not known: {camera.reason}"]
    if camera.looks:
        pitch, roll, error = (figures[name] for name in ("pitch_deg", "roll_deg", "up_error_deg"))
        lines = [f"pitch {pitch:.1f} and roll {roll:.1f} degrees, standard deviation of up {error:.1f}"]
    return [
        *lines,
        *(each.text for each in take.notices),
        f"focal length {camera.focal_px:.0f} pixels, standard deviation {camera.focal_sd_px:.0f}, {source}",
    ]


def inspect_video(path: Path) -> InspectedVideo:
    """A video file's facts and its camera. InputError when it is none, or cannot be read."""
    take = Take(path.name, video=read_video(path, AS_IF_FPS))
    return InspectedVideo(registry.load("stages", "calibrate")()(take))


def inspect_image(path: Path) -> InspectedImage:
    """An image's camera. InputError when it is none, or cannot be read."""
    stage = registry.load("stages", "calibrate")()
    return InspectedImage(path, stage.of_image(path.name, read_image(path)))
