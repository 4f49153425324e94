"""Images as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import InputError
from .atomic import whole_file


def write_png(path: Path, image: np.ndarray) -> None:
    """Write the image (H, W, 3) uint8 BGR. OpenCV makes the content only: on Windows it finds no path that is not
    ASCII. InputError when it is no image."""
    import cv2

    done, content = cv2.imencode(".png", image)
    if not done:
        raise InputError("cannot-write", f"The image {path} could not be made.")
    with whole_file(path) as partial:
        partial.write_bytes(content.tobytes())
