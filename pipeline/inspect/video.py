"""What a run would find in a video before it looks at anybody."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.camera import pitch_roll_deg
from ..core.messages import how_many, rate_in_words
from ..core.take import Take, Video
from ..files.video_frames import shown_size
from ..plugins import registry
from ..reading.load import read_video
from ..signals.rates import rate_doubts


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
        video, camera = self.video, self.take.camera
        width, height = shown_size(video)
        found: dict[str, Any] = {
            "file": str(video.path), "codec": video.codec, "width": width, "height": height,
            "rotation_deg": video.rotation_deg, "frames": len(video.time_s), "fps": video.fps,
            "capture_fps": video.capture_fps,
            "duration_s": float(video.time_s[-1] + np.nan_to_num(1 / video.fps)),
            "pitch_deg": None, "roll_deg": None, "up_error_deg": None,
        }  # fmt: skip
        if camera is None:
            return found
        found |= {
            "focal_px": camera.focal_px,
            "focal_sd_px": camera.focal_sd_px,
            "focal_source": camera.focal_source,
        }
        if camera.looks:
            pitch, roll = pitch_roll_deg(camera.looks[0].up)
            found |= {
                "pitch_deg": float(pitch),
                "roll_deg": float(roll),
                "up_error_deg": camera.looks[0].error_deg,
            }
        return found

    def __str__(self) -> str:
        said = self.figures()
        turned = f", turned by {said['rotation_deg']} degrees" if said["rotation_deg"] else ""
        lines = [
            f"{said['file']}: video, {said['codec']}, {said['width']} x {said['height']} pixels{turned}",
            f"{how_many(said['frames'], 'frame')}{rate_in_words(said['fps'], ', ')}, {said['duration_s']:.1f} s",
            *(each.text for each in (*self.video.doubts, *rate_doubts(None, self.video), *self.take.notices)),
        ]
        return "\n".join(lines)


def inspect_video(path: Path) -> InspectedVideo:
    """A video file's facts and its camera. InputError when it is none, or cannot be read."""
    take = Take(path.name, video=read_video(path))
    return InspectedVideo(registry.load("stages", "calibrate")()(take))
