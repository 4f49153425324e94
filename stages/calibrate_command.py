"""What images say about their camera:  pcnet3d calibrate VIDEO | IMAGE ..."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..adapters import video as videos
from ..models.gravity.view import camera_of, static_camera
from ..pipeline.core.camera import Camera, pitch_roll_deg
from ..pipeline.core.device import computing_on
from ..pipeline.core.errors import InputError, readable
from ..pipeline.core.take import Told
from ..pipeline.files.images import write_png
from ..pipeline.files.video_frames import images_at
from ..pipeline.reading.settings import OnDevice
from .drawing.image_lines import drawn

_SAYS = {"told": "as told", "file": "by the video file", "lines": "by the lines", "prior": "a guess"}
UNKNOWN = 3  # exit code: no up


def calibrate(
    files: Annotated[list[Path], typer.Argument(help="A video, or images of one camera that stood still.")],
    focal: Annotated[float | None, typer.Option(help="Focal length in pixels, if known.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Write this image (PNG): the lines, the horizon and up.")
    ] = None,
    device: OnDevice = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Find a camera's pitch, roll and focal length from the straight lines in its images.

    The exit code is 3 if the lines do not show them. People may be in the image.
    """
    with computing_on(device) as where:
        found, image = _looked(files, Told(focal_px=focal).focal_px)
    content = {**figures(found), "device": where.summary()}
    print(json.dumps(content, indent=1) if as_json else in_words(found))
    if picture is not None and found.looks:
        write_png(picture, drawn(image, found, found.looks[0])[:, :, ::-1])
    raise typer.Exit(0 if found.looks else UNKNOWN)


def figures(camera: Camera) -> dict[str, Any]:
    """The figures, each with its standard deviation (`_sd`); None for a figure that is not known."""
    content: dict[str, Any] = {
        "image_size": list(camera.image_size),
        "focal_px": camera.focal_px,
        "focal_px_sd": camera.focal_sd_px,
        "sources": {"focal": camera.focal_source, "up": None},
        "pitch_deg": None, "pitch_deg_sd": None, "roll_deg": None, "roll_deg_sd": None, "up": None,
        "reason": camera.reason or None,
    }  # fmt: skip
    if camera.looks:
        look = camera.looks[0]
        pitch, roll = pitch_roll_deg(look.up)
        pitch_sd, roll_sd = pitch_roll_sd_deg(look.up, look.covariance)
        content |= {"pitch_deg": float(pitch), "pitch_deg_sd": pitch_sd, "roll_deg": float(roll)}
        content |= {"roll_deg_sd": roll_sd, "up": look.up.tolist()}
        content["sources"]["up"] = "lines"
    return content


def pitch_roll_sd_deg(up: np.ndarray, covariance: np.ndarray) -> tuple[float, float]:
    """Standard deviations of pitch and roll, degrees, for up (3,) and its covariance (3, 3) in square radians; to first
    order."""
    step = 1e-5
    slopes = np.stack(
        [(pitch_roll_deg(up + step * axis) - pitch_roll_deg(up)) / step for axis in np.eye(3)], axis=-1
    )
    pitch, roll = np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    return float(pitch), float(roll)


def in_words(camera: Camera) -> str:
    """The same for a reader."""
    focal = f"focal length {camera.focal_px:.0f} pixels, sd {camera.focal_sd_px:.0f} ({_SAYS[camera.focal_source]})"
    if not camera.looks:
        return f"up is not known: {camera.reason}\n{focal}"
    known = figures(camera)
    return (
        f"pitch {known['pitch_deg']:.1f} degrees, sd {known['pitch_deg_sd']:.1f} (positive looks down)\n"
        f"roll {known['roll_deg']:.1f} degrees, sd {known['roll_deg_sd']:.1f} (positive turns the image's content "
        f"counter-clockwise)\n{focal}"
    )


def _looked(files: list[Path], focal: float | None) -> tuple[Camera, np.ndarray]:
    """The camera, and the image whose lines it keeps."""
    if len(files) == 1 and videos.sniff(files[0]):
        (video,) = videos.read(files[0])
        found = camera_of(video, focal_px=focal)
        shown = images_at(video, [look.frame for look in found.looks[:1]])
        return found, next(iter(shown.values()), np.zeros((2, 2, 3), np.uint8))
    images = {number: _image(path) for number, path in enumerate(files)}
    return static_camera(images, {}, focal), images[0]


def _image(path: Path) -> np.ndarray:
    """(H, W, 3) uint8 RGB."""
    import cv2

    with readable(path, "an image or a video"):
        content = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    if image is None:
        raise InputError(
            "format-unknown", f"Expected an image (PNG, JPEG, ...), or one video alone; {path} is no image."
        )
    return np.ascontiguousarray(image[:, :, ::-1])
