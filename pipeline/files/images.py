"""Images as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import InputError, readable
from .atomic import whole_file

_SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".webp")


def images_in(folder: Path) -> list[Path]:
    """The images of a folder, by the ends of their names, sorted; none of anything else."""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return [file for file in files if file.suffix.lower() in _SUFFIXES and not file.name.startswith(".")]


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


def write_png(path: Path, image: np.ndarray) -> None:
    """Write the image (H, W, 3) uint8 BGR. OpenCV makes the content only: on Windows it finds no path that is not
    ASCII. InputError when it is no image."""
    import cv2

    done, content = cv2.imencode(".png", image)
    if not done:
        raise InputError("cannot-write", f"The image {path} could not be made.")
    with whole_file(path) as partial:
        partial.write_bytes(content.tobytes())
