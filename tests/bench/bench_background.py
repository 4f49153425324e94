"""How long it takes to see whether the camera of a video moves, its images once decoded:

    python tests/bench/bench_background.py VIDEO...

Processor seconds, the median of five. A camera that stands still is known by fewer images.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from pcnet3d.models.gravity import view
from pcnet3d.models.gravity.background import stands
from pcnet3d.pipeline.files.video_frames import images_at
from pcnet3d.pipeline.reading.load import read_video


def seconds(path: Path) -> tuple[float, float]:
    """Of the video, and of looking at its background; decoding is not counted."""
    video = read_video(path)
    last = len(video.time_s) - 1
    decoded: dict[int, np.ndarray] = {}

    def kept(_, frames):
        wanted = [frame for frame in frames if frame not in decoded]
        decoded.update(images_at(video, wanted) if wanted else {})
        return {frame: decoded[frame] for frame in frames if frame in decoded}

    took = []
    setattr(view, "images_at", kept)  # noqa: B010
    try:
        for _ in range(6):  # the first one decodes
            begun = time.process_time()
            frames = view._spread(0, last)
            images = kept(video, frames)
            if not stands(images, view._boxes([], frames)):
                view._background(video, [], (0, last))
            took.append(time.process_time() - begun)
    finally:
        setattr(view, "images_at", images_at)  # noqa: B010
    return float(video.time_s[-1] - video.time_s[0]), float(np.median(took[1:]))


if __name__ == "__main__":
    for name in sys.argv[1:]:
        lasts_s, took_s = seconds(Path(name))
        print(f"{name}: {lasts_s:.1f} s of video, {took_s:.2f} s to look at its background")
