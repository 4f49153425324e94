"""What a take of a study costs beyond its networks:  pcnet3d lab bench batch

The study is run in a process of its own, so that the peak of memory is that of its workers.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....examples.walker.camera import camera_poses, side_camera
from ....examples.walker.walk import walker
from ....pipeline.core.device import AUTO, Device, computing_on
from ....pipeline.files.atomic import write_rows
from ....pipeline.reading.settings import OnDevice
from ....stages.study.batch.command import batch as run_batch
from ...rectifier.load import load_rectifier
from ...rectifier.onnx import PCNetRectifier
from ..common.modules import in_own_process
from .run import cpu_s, gemm_gflops, peak_mb, took_s

_TAKES, _SECONDS = 20, 5.0  # of the study, and how long each is


@dataclass(frozen=True)
class MeasuredBatch:
    """wall_s, cpu_s: all of the batch, on the clock and of all processes together. network_s: of one take, in one
    thread. peak_mb: resident memory of the largest worker."""

    takes: int
    workers: int
    wall_s: float
    cpu_s: float
    network_s: float
    peak_mb: float

    @property
    def own_s(self) -> float:
        """Of a take, in its worker: its part of the study's start, table and page too."""
        return self.wall_s * min(self.workers, self.takes) / self.takes - self.network_s

    def __str__(self) -> str:
        return (
            f"{self.takes} takes, {self.workers} at a time, in {self.wall_s:.1f} s ({self.cpu_s:.1f} s of CPU)\n"
            f"  a take         {self.own_s:8.2f} s  besides {1000 * self.network_s:.0f} ms in the network, "
            f"{self.cpu_s / self.takes:.2f} s of CPU\n"
            f"  peak memory of a worker {self.peak_mb:.0f} MB"
        )


def batch(
    workers: Annotated[int, typer.Option(min=1, help="Takes at a time.")] = 1,
    device: OnDevice = "auto",
) -> None:
    """Measure a study of short takes: what each costs beyond its networks, and the memory of the processes."""
    print(f"matrix products: {gemm_gflops():.0f} GFLOP/s in float32")
    print(in_own_process(measured_batch, _TAKES, _SECONDS, workers, device))


def measured_batch(takes: int, seconds: float, workers: int, device: Device = AUTO) -> MeasuredBatch:
    """A study of so many takes of poses, all different, in a temporary folder. The peak of memory is that of all child
    processes that this one has had."""
    with tempfile.TemporaryDirectory() as folder:
        manifest = write_takes(Path(folder), takes, seconds)
        joints = np.load(Path(folder) / "take_000.npy")
        start, before = time.perf_counter(), cpu_s()
        with contextlib.redirect_stdout(io.StringIO()):
            run_batch(manifest, Path(folder) / "out", workers, device=device)
        wall_s, used_s = time.perf_counter() - start, cpu_s() - before
    with computing_on(device):
        # The best of three times, in one thread.
        network = load_rectifier("pcnet")
        assert isinstance(network, PCNetRectifier)
        network = PCNetRectifier(network.path, threads=1)
        network_s = min(took_s(lambda: network.rotation(joints)) for _ in range(3))
    return MeasuredBatch(takes, workers, wall_s, used_s, network_s, peak_mb(of_children=True))


def write_takes(folder: Path, takes: int, seconds: float) -> Path:
    """The manifest of files of poses, each the walker with noise of its own."""
    walk = walker(seconds=seconds)
    joints = camera_poses(walk, side_camera(walk)).joints
    names = [f"take_{number:03}" for number in range(takes)]
    for number, name in enumerate(names):
        noise = np.random.default_rng(number).normal(scale=0.003, size=joints.shape)
        np.save(folder / f"{name}.npy", (joints + noise).astype(np.float32))
    manifest = folder / "manifest.csv"
    rows = ((name, f"{name}.npy", f"{walk.fps:g}", f"{walk.stature_m:.2f}") for name in names)
    write_rows(manifest, ("name", "poses", "fps", "stature"), rows)
    return manifest
