"""Where time and memory go from a video alone to its recording:  pcnet3d lab bench pipeline --detector FILE.onnx

The video is run in a process of its own, so that the peak of memory is its own.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer

from ....examples.walker.long_video import write_long_video
from ....pipeline.core.device import Device
from ....pipeline.core.take import Video
from ....pipeline.files.video_frames import images_from
from ....pipeline.plugins.registry import open_model
from ....pipeline.reading.settings import OnDevice, RunOptions
from ....pipeline.running.recipe import load_recipe
from ...common.onnx import OnnxFile
from ...detector import video as detect_video
from ..common.modules import in_own_process
from .run import Measured, gemm_gflops, measured_run

_DECODED = 1000  # frames that the rate of decoding is measured on


def pipeline(
    video: Annotated[
        Path | None, typer.Argument(help="A video; by default one of the walker is made.")
    ] = None,
    detector: Annotated[str, typer.Option(help="As for `run`.")] = "movenet",
    minutes: Annotated[float, typer.Option(min=0.05, help="Length of the walker's video.")] = 1.0,
    device: OnDevice = "auto",
) -> None:
    """Measure a run on a video alone: the 2D network and our own stages, their shares, and the memory."""
    file = open_model("detectors", detector)  # before any work, and downloaded outside the measurement
    print(f"matrix products: {gemm_gflops():.0f} GFLOP/s in float32")
    with tempfile.TemporaryDirectory() as folder:
        if video is None:
            video = Path(folder) / "walker.mp4"
            write_long_video(video, 60 * minutes)
        measured, decoded = in_own_process(_run, video, file, device)
    print(measured)
    own_s = measured.wall_s - measured.seconds["2D network"]
    print(f"  all but the 2D network: {own_s:.1f} s, {100 * own_s / measured.wall_s:.1f} %")
    print(f"  decoding alone: {decoded:.0f} frames/s")


def _run(video: Path, detector: Path, device: Device) -> tuple[Measured, float]:
    """detect without waiting for images and without the network, which stand by themselves; frames: of the video. And
    how many images a second decoding alone gives."""
    recipe = load_recipe().starting_with("lift").starting_with("calibrate").starting_with("detect")
    recipe = recipe.with_options("detect", detector=str(detector))
    others = {"images": 0.0, "2D network": 0.0}
    with _timed(others):
        take, measured = measured_run(RunOptions(video=video, device=device), recipe)
    seconds = {"read": measured.seconds["read"], **others, **measured.seconds}
    seconds["detect"] -= sum(others.values())
    film = take.need("video")
    return replace(measured, seconds=seconds, frames=len(film.time_s)), _decoded_a_second(film)


def _decoded_a_second(video: Video) -> float:
    start = time.perf_counter()
    count = sum(1 for _ in images_from(video, last=_DECODED - 1))
    return count / (time.perf_counter() - start)


@contextmanager
def _timed(seconds: dict[str, float]) -> Iterator[None]:
    """Adds up how long detection waits for images, which are decoded beside it, and what running 2D networks takes,
    while the block runs."""
    decode, run = detect_video.images_ahead, OnnxFile.run

    def images_ahead(*asked: Any) -> Iterator[tuple[int, np.ndarray]]:
        decoding = decode(*asked)
        while True:
            start = time.perf_counter()
            following = next(decoding, None)
            seconds["images"] += time.perf_counter() - start
            if following is None:
                return
            yield following

    def timed_run(self: OnnxFile, value: np.ndarray) -> list[np.ndarray]:
        start = time.perf_counter()
        try:
            return run(self, value)
        finally:
            seconds["2D network"] += time.perf_counter() - start

    with patch.object(detect_video, "images_ahead", images_ahead), patch.object(OnnxFile, "run", timed_run):
        yield
