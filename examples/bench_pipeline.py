"""Where the time and the memory go from a video alone to its recording:  pcnet3d bench pipeline --detector FILE.onnx

Every length of video is run in a process of its own, so that its peak of memory is its own.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, fields, is_dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer

from ..models.common.onnx import OnnxFile
from ..models.detector import video as detect_video
from ..pipeline.plugins.registry import open_model
from ..pipeline.reading.settings import RunOptions
from ..pipeline.running.recipe import load_recipe
from ..pipeline.running.run import run_files
from ..pipeline.take import Video
from .walker.long_video import write_long_video

_MEGABYTE = 2**20
_PEAK_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes of getrusage's ru_maxrss


def pipeline(
    video: Annotated[
        Path | None, typer.Argument(help="A video; without it one of the walker is made.")
    ] = None,
    detector: Annotated[str, typer.Option(help="As of `run`.")] = "movenet",
    minutes: Annotated[
        list[float],
        typer.Option(min=0.05, help="Length of the walker's video; repeatable, to compare memory."),
    ] = [1.0],  # noqa: B006 (typer copies it)
) -> None:
    """Measure a run on a video alone: decoding, the 2D network and our own stages, their shares, and the memory."""
    file = open_model("detectors", detector)  # before any work, and downloaded outside the measurement
    if video is not None:
        _print(_measured(video, file))
        return
    with tempfile.TemporaryDirectory() as folder:
        first: Measured | None = None
        for length in minutes:
            made = Path(folder) / "walker.mp4"
            write_long_video(made, 60 * length)
            measured = _measured(made, file)
            _print(measured)
            if first is not None:
                more = measured.memory_mb - first.memory_mb
                print(f"  {more:+.0f} MB against the first, result arrays aside")
            first = first or measured


@dataclass(frozen=True)
class Measured:
    """seconds: of every stage by name; detect without decoding and network, which are `decoding` and `2D network`.
    wall_s: all of the run. peak_mb: resident memory. arrays_mb: the take's arrays."""

    frames: int
    seconds: dict[str, float]
    wall_s: float
    peak_mb: float
    arrays_mb: float

    @property
    def memory_mb(self) -> float:
        return self.peak_mb - self.arrays_mb

    @property
    def own_share(self) -> float:
        """Of the wall time, what is neither decoding nor the 2D network."""
        return 1 - (self.seconds["decoding"] + self.seconds["2D network"]) / self.wall_s


def _print(measured: Measured) -> None:
    rate = measured.frames / measured.wall_s
    print(f"{measured.frames} frames in {measured.wall_s:.1f} s, {rate:.1f} frames/s")
    for name, seconds in measured.seconds.items():
        print(f"  {name:<12} {seconds:8.2f} s  {100 * seconds / measured.wall_s:5.1f} %")
    print(f"  our own stages together: {100 * measured.own_share:.1f} %")
    print(
        f"  peak memory {measured.peak_mb:.0f} MB, of which {measured.arrays_mb:.0f} MB are the results' arrays"
    )


def _measured(video: Path, detector: Path) -> Measured:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(_run, video, detector).result()


def _run(video: Path, detector: Path) -> Measured:
    import resource  # not on Windows

    recipe = load_recipe().starting_with("lift").starting_with("detect")
    recipe = recipe.with_options("detect", detector=str(detector))
    seconds = {"read": 0.0, "decoding": 0.0, "2D network": 0.0}
    with _timed(seconds), tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        take = run_files(
            RunOptions(video=video),
            Path(folder) / "out",
            recipe,
            done=lambda stage, taken: seconds.__setitem__(stage, taken),
        )
        wall_s = time.perf_counter() - start
    seconds["detect"] -= seconds["decoding"] + seconds["2D network"]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _PEAK_UNIT / _MEGABYTE
    return Measured(len(take.need("video").time_s), seconds, wall_s, peak, _array_bytes(take) / _MEGABYTE)


@contextmanager
def _timed(seconds: dict[str, float]) -> Iterator[None]:
    """Adds up what decoding images and running 2D networks take, while the block runs."""
    decode, run = detect_video.images_from, OnnxFile.run

    def images_from(video: Video, first: int = 0) -> Iterator[tuple[int, np.ndarray]]:
        decoding = decode(video, first)
        while True:
            start = time.perf_counter()
            following = next(decoding, None)
            seconds["decoding"] += time.perf_counter() - start
            if following is None:
                return
            yield following

    def timed_run(self: OnnxFile, value: np.ndarray) -> list[np.ndarray]:
        start = time.perf_counter()
        try:
            return run(self, value)
        finally:
            seconds["2D network"] += time.perf_counter() - start

    with (
        patch.object(detect_video, "images_from", images_from),
        patch.object(OnnxFile, "run", timed_run),
    ):
        yield


def _array_bytes(value: Any) -> int:
    """Of all arrays in a take."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, dict):
        return sum(map(_array_bytes, value.values()))
    if is_dataclass(value):
        return sum(_array_bytes(getattr(value, field.name)) for field in fields(value))
    return 0
