"""What a take of a study costs beyond its networks:  pcnet3d lab bench batch"""

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
from .run import gemm_gflops, took_s

_TAKES, _SECONDS = 20, 5.0  # of the study, and how long each is


@dataclass(frozen=True)
class MeasuredBatch:
    """wall_s: all of the batch, on the clock. network_s: of one take, in one thread."""

    takes: int
    workers: int
    wall_s: float
    network_s: float

    @property
    def own_s(self) -> float:
        """Of a take, in its worker: its part of the study's start, table and page too."""
        return self.wall_s * min(self.workers, self.takes) / self.takes - self.network_s

    def __str__(self) -> str:
        return (
            f"{self.takes} takes, {self.workers} at a time, in {self.wall_s:.1f} s\n"
            f"  a take         {self.own_s:8.2f} s  besides {1000 * self.network_s:.0f} ms in the network"
        )


def batch(
    workers: Annotated[int, typer.Option(min=1, help="Takes at a time.")] = 1,
    device: OnDevice = "auto",
) -> None:
    """Measure a study of short takes: what each costs beyond its networks."""
    print(f"matrix products: {gemm_gflops():.0f} GFLOP/s in float32")
    print(measured_batch(_TAKES, _SECONDS, workers, device))


def measured_batch(takes: int, seconds: float, workers: int, device: Device = AUTO) -> MeasuredBatch:
    """A study of so many takes of poses, all different, in a temporary folder."""
    with tempfile.TemporaryDirectory() as folder:
        manifest = write_takes(Path(folder), takes, seconds)
        joints = np.load(Path(folder) / "take_000.npy")
        start = time.perf_counter()
        with contextlib.redirect_stdout(io.StringIO()):
            run_batch(manifest, Path(folder) / "out", workers, device=device)
        wall_s = time.perf_counter() - start
    with computing_on(device):
        # The best of three times, in one thread.
        network = load_rectifier("pcnet")
        assert isinstance(network, PCNetRectifier)
        network = PCNetRectifier(network.path, threads=1)
        network_s = min(took_s(lambda: network.rotation(joints)) for _ in range(3))
    return MeasuredBatch(takes, workers, wall_s, network_s)


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
