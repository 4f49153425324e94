"""Tiny videos."""

import signal
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np


def film_of(
    path: Path,
    images,
    stamps_ms,
    codec="libx264",
    *,
    rotation=None,
    first_ms=0,
    pixels=None,
    muxing=None,
    **options,
) -> Path:
    """A video of these images (H, W, 3) RGB, which have the given time stamps in milliseconds. rotation: the display
    matrix's, in degrees anticlockwise. pixels: how many times as wide as high players show them, a Fraction. options:
    of the codec; muxing: of the file."""
    import av

    tick = Fraction(1, 1000)
    height, width = images[0].shape[:2]
    with av.open(path, "w", options=muxing or {}) as container:
        stream = container.add_stream(codec, rate=30, options={name: str(of) for name, of in options.items()})
        stream.width, stream.height = width, height
        stream.pix_fmt = "yuv420p" if width % 2 == height % 2 == 0 else "yuv444p"
        if codec == "gif":
            stream.pix_fmt = "rgb8"
        stream.codec_context.time_base = stream.time_base = tick
        if pixels is not None:
            stream.codec_context.sample_aspect_ratio = pixels
        if rotation is not None:
            stream.set_display_rotation(rotation)
        frames = [av.VideoFrame.from_ndarray(np.ascontiguousarray(image), "rgb24") for image in images]
        for frame, stamp in zip(frames, stamps_ms, strict=True):
            frame.pts, frame.time_base = int(stamp), tick
        for frame in (*frames, None):
            for packet in stream.encode(frame):
                shift = int(first_ms / 1000 / packet.time_base)
                packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
                container.mux(packet)
    return path


def film(
    path: Path, stamps_ms, *, codec="libx264", reordered=0, first_ms=0, rotation=None, pixels=None, **muxing
):
    """A video of 64 x 48 pixels, each image of one grey."""
    images = [np.full((48, 64, 3), 9 * i % 255, np.uint8) for i in range(len(stamps_ms))]
    how = {"bf": reordered} if codec == "libx264" else {}
    return film_of(
        path,
        images,
        stamps_ms,
        codec,
        rotation=rotation,
        first_ms=first_ms,
        pixels=pixels,
        muxing=muxing,
        **how,
    )


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
