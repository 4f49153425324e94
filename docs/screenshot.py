"""A picture of a recording as the viewer shows it, made without a screen: `screenshot.py take.rrd 40 out.png`.

Needs a Vulkan driver (Debian: mesa-vulkan-drivers renders without a graphics card) and, for a video in the
recording, the program ffmpeg.
"""

from __future__ import annotations

import argparse
import os
import socket
import time
from pathlib import Path

import cv2
import numpy as np

from pcnet3d.pipeline.files.viewer import QUIET, viewer_executable

TOP_BAR = 37  # rows of pixels; it would speak of the machine that rendered the picture


def screenshot(recording: Path, frame: int, picture: Path, settle_s: float = 6.0) -> None:
    """Open the recording at a video frame, wait until the video is decoded and messages are gone, take a picture."""
    from rerun.experimental import ViewerClient

    os.environ.update(QUIET)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    viewer = ViewerClient.spawn(
        headless=True, port=port, hide_welcome_screen=True, executable_path=viewer_executable()
    )
    try:
        viewer.open(str(recording.resolve()))
        viewer.set_time("frame", sequence=frame, play_state="paused")
        time.sleep(settle_s)
        shot = cv2.imdecode(np.frombuffer(viewer.take_screenshot(), np.uint8), cv2.IMREAD_COLOR)
    finally:
        viewer.quit()
    cv2.imwrite(str(picture), np.asarray(shot)[TOP_BAR:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("frame", type=int)
    parser.add_argument("picture", type=Path)
    given = parser.parse_args()
    screenshot(given.recording, given.frame, given.picture)


if __name__ == "__main__":
    main()
