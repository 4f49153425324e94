"""Images as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import InputError, readable


def is_image(path: Path) -> bool:
    """Whether a file begins like an image that OpenCV reads (PNG, JPEG, WebP, TIFF, BMP and others). Never raises."""
    import cv2

    return path.is_file() and cv2.haveImageReader(str(path))


def read_image(path: Path) -> np.ndarray:
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
