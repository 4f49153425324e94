"""A picture of a recording as the viewer shows it, made without a screen.

Needs a Vulkan driver (Debian: mesa-vulkan-drivers renders without a graphics card) and, for a video in the
recording, the program ffmpeg.
"""

from __future__ import annotations

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

_SETTLES_S = 8.0
TOP_BAR = 37  # rows of pixels; it would speak of the machine that rendered the picture


def screenshot(recording: Path, frame: int, picture: Path) -> None:
    """Open the recording at a video frame, wait until the video is decoded and messages are gone, take a picture.

    A processor that draws for others too is late with it: so the picture is asked for more than once."""
    from rerun.experimental import ViewerClient

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--window-size", "1280x720"]
    command = [viewer_executable(), *options, str(recording.resolve())]
    with subprocess.Popen(command, env=os.environ | QUIET) as viewer:
        try:
            time.sleep(_SETTLES_S)  # until it listens
            client = ViewerClient(f"rerun+http://127.0.0.1:{port}/proxy")
            client.set_time("frame", sequence=frame, play_state="paused")
            time.sleep(_SETTLES_S)
            shot = cv2.imdecode(np.frombuffer(_taken(client), np.uint8), cv2.IMREAD_COLOR)
        finally:
            viewer.terminate()
    cv2.imwrite(str(picture), np.asarray(shot)[TOP_BAR:])


def _taken(client: ViewerClient) -> bytes:
    for _ in range(5):
        with suppress(TimeoutError):
            return client.take_screenshot()
    raise SystemExit("The viewer draws too slowly here.")
