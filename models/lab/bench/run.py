"""A run measured by stage: seconds, memory, and what the machine does at best beside them."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....pipeline.core.system import peak_memory_bytes
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import read_summary
from ....pipeline.reading.settings import RunOptions
from ....pipeline.running.recipe import Recipe
from ....pipeline.running.run import run_files

_MEGABYTE = 2**20
_GEMM, _GEMM_RUNS = 1024, 20


@dataclass(frozen=True)
class Measured:
    """seconds: wall time of the run's parts by name, which add up to wall_s. wall_s, cpu_s: all of the run, on the
    clock and of all threads together. peak_mb: resident memory. arrays_mb: the take's arrays. devices: where each
    network computed, by its file's name."""

    frames: int
    seconds: dict[str, float]
    wall_s: float
    cpu_s: float
    peak_mb: float
    arrays_mb: float
    devices: dict[str, str]

    def __str__(self) -> str:
        rate = self.frames / self.wall_s
        lines = [
            f"{self.frames} frames in {self.wall_s:.1f} s ({self.cpu_s:.1f} s of CPU), {rate:.1f} frames/s"
        ]
        lines += [
            f"  {name:<14} {taken:8.2f} s  {100 * taken / self.wall_s:5.1f} %"
            for name, taken in self.seconds.items()
        ]
        memory = f"{self.peak_mb:.0f} MB, of which {self.arrays_mb:.0f} MB are the results' arrays"
        networks = ", ".join(f"{name} on {device}" for name, device in self.devices.items())
        return "\n".join([*lines, f"  peak memory {memory}", f"  networks: {networks}"])


def measured_run(options: RunOptions, recipe: Recipe | None = None) -> tuple[Take, Measured]:
    """A run into a temporary folder. The peak of memory is that of this process since it began."""
    seconds = {"read": 0.0}
    with tempfile.TemporaryDirectory() as folder:
        start, before = time.perf_counter(), cpu_s()
        take = run_files(options, Path(folder) / "out", recipe, done=seconds.__setitem__)
        wall_s, used_s = time.perf_counter() - start, cpu_s() - before
        devices = read_summary(Path(folder) / "out")["device"]["networks"]
    seconds["the rest"] = wall_s - sum(seconds.values())  # imports of stages, the folder
    frames = len(take.need("poses"))
    return take, Measured(frames, seconds, wall_s, used_s, peak_mb(), _array_bytes(take) / _MEGABYTE, devices)


def gemm_gflops() -> float:
    """What numpy's product of two float32 matrices of 1024 x 1024 does a second, on all cores that it takes."""
    rng = np.random.default_rng(0)
    a, b = (rng.standard_normal((_GEMM, _GEMM), dtype=np.float32) for _ in range(2))
    np.matmul(a, b)
    seconds = sum(took_s(lambda: np.matmul(a, b)) for _ in range(_GEMM_RUNS))
    return 2 * _GEMM**3 * _GEMM_RUNS / seconds / 1e9


def took_s(action: Callable[[], object]) -> float:
    """Seconds of wall time that it takes."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def cpu_s() -> float:
    """That this process and those that it has waited for have used so far."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def peak_mb() -> float:
    """The most memory that was resident in this process so far."""
    return peak_memory_bytes() / _MEGABYTE


def _array_bytes(value: Any) -> int:
    """Of all arrays in a take."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, dict):
        return sum(map(_array_bytes, value.values()))
    if is_dataclass(value):
        return sum(_array_bytes(getattr(value, field.name)) for field in fields(value))
    return 0
