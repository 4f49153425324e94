"""Tiny videos."""

import signal
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np


def film(
    path: Path, stamps_ms, *, codec="libx264", rotation=None, first_ms=0, reordered=0, pixels=None, **options
) -> Path:
    """A video of 64 x 48 pixels whose frames have the given time stamps in milliseconds. pixels: how many times as wide
    as high players show them, a Fraction."""
    import av

    with av.open(path, "w", options=options) as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.codec_context.time_base = stream.time_base = Fraction(1, 1000)
        if codec == "libx264":
            stream.options = {"bf": str(reordered)}
        if pixels is not None:
            stream.codec_context.sample_aspect_ratio = pixels
        if rotation is not None:
            stream.set_display_rotation(rotation)
        images = []
        for i, stamp in enumerate(stamps_ms):
            image = av.VideoFrame.from_ndarray(np.full((48, 64, 3), 9 * i % 255, np.uint8), format="rgb24")
            image.pts, image.time_base = stamp, Fraction(1, 1000)
            images.append(image)
        for image in (*images, None):
            for packet in stream.encode(image):
                shift = int(first_ms / 1000 / packet.time_base)
                packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                container.mux(packet)
    return path


def film_of(path: Path, images, fps: int = 30) -> Path:
    """A video of these images (H, W, 3) RGB, of even sides or a pixel less."""
    import av

    height, width = (side // 2 * 2 for side in images[0].shape[:2])
    with av.open(path, "w") as container:
        stream = container.add_stream("libx264", rate=fps)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "16", "preset": "ultrafast", "g": "5"}
        for image in images:
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="rgb24")
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return path


def pressing_ctrl_c(
    images: Callable[..., Iterator[tuple[int, np.ndarray]]], at: int
) -> Callable[..., Iterator]:
    """images_ahead, with Ctrl-C pressed before frame `at` is shown."""

    def shown(*asked: object) -> Iterator[tuple[int, np.ndarray]]:
        for number, image in images(*asked):
            if number == at:
                signal.raise_signal(signal.SIGINT)
            yield number, image

    return shown


def noting(
    images: Callable[..., Iterator[tuple[int, np.ndarray]]], seen: list[int]
) -> Callable[..., Iterator]:
    """images_ahead, whose frame numbers are added to `seen`."""

    def shown(*asked: object) -> Iterator[tuple[int, np.ndarray]]:
        for number, image in images(*asked):
            seen.append(number)
            yield number, image

    return shown
