"""A picture of a recording as the viewer shows it, made without a screen: `screenshot.py take.rrd 40 out.png`.

Needs a Vulkan driver (Debian: mesa-vulkan-drivers renders without a graphics card) and, for a video in the
recording, the program ffmpeg.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from pcnet3d.pipeline.files.viewer import QUIET, viewer_executable

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient

TOP_BAR = 37  # rows of pixels; it would speak of the machine that rendered the picture


def screenshot(
    recording: Path, frame: int, picture: Path, size: str = "1280x720", settle_s: float = 8.0
) -> None:
    """Open the recording at a video frame, wait until the video is decoded and messages are gone, take a picture.

    A processor that draws for others too is late with it: so the picture is asked for more than once."""
    from rerun.experimental import ViewerClient

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", size]
    command = [viewer_executable(), *options, str(recording.resolve())]
    with subprocess.Popen(command, env=os.environ | QUIET) as viewer:
        try:
            time.sleep(settle_s)  # until it listens
            client = ViewerClient(f"rerun+http://127.0.0.1:{port}/proxy")
            client.set_time("frame", sequence=frame, play_state="paused")
            time.sleep(settle_s)
            shot = cv2.imdecode(np.frombuffer(_taken(client), np.uint8), cv2.IMREAD_COLOR)
        finally:
            viewer.terminate()
    cv2.imwrite(str(picture), np.asarray(shot)[TOP_BAR:])


def _taken(client: ViewerClient) -> bytes:
    for _ in range(5):
        with suppress(TimeoutError):
            return client.take_screenshot()
    raise SystemExit("The viewer draws too slowly here.")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("frame", type=int)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", default="1280x720")
    given = parser.parse_args()
    screenshot(given.recording, given.frame, given.picture, given.size)


if __name__ == "__main__":
    main()
