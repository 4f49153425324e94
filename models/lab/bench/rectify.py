"""How fast rectifiers are on this machine, beside what its processor can do:  pcnet3d bench rectify

Speeds of shared machines drift, so everything is measured in turns, several rounds.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ....examples.walker import camera_poses, side_camera, walker
from ....pipeline.core.device import CPU, computing_on, placement
from ....pipeline.core.errors import InputError
from ....pipeline.reading.settings import OnDevice
from ...gravity.live import LiveRectifier
from ...rectifier.load import load_rectifier
from ...rectifier.onnx import PCNetRectifier
from .run import gemm_gflops, took_s

_SINGLES = 300
_STARTS = 3
_FIRST_POSE = (
    "import sys, numpy; from pcnet3d.models import load_rectifier; "
    "from pcnet3d.pipeline.core.device import computing_on\n"
    "with computing_on(sys.argv[2]): "
    "load_rectifier(sys.argv[1]).rotation(numpy.random.default_rng(0).normal(size=(1, 17, 3)))"
)


def rectify(
    rectifier: Annotated[
        list[str], typer.Option(help="A network by name, or its .onnx file; repeatable.")
    ] = ["pcnet"],  # noqa: B006 (typer copies it)
    count: Annotated[int, typer.Option(min=1, help="Poses per batch.")] = 10_000,
    rounds: Annotated[int, typer.Option(min=1, help="How often everything is measured.")] = 5,
    threads: Annotated[
        int | None, typer.Option(min=1, help="CPU threads; by default all that the process may use.")
    ] = None,
    device: OnDevice = "auto",
) -> None:
    """Measure a rectifier's speed beside the machine's own speed, and that of others beside the first one."""
    with computing_on(device) as where:
        results = {**measure(rectifier, count, rounds, threads), "device": where.summary()}
    print(as_text(results))


def measure(names: list[str], count: int, rounds: int, threads: int | None = None) -> dict[str, Any]:
    """Everything that is printed. InputError for a name that is no network."""
    import onnxruntime

    opened = {name: _open(name, threads) for name in names}
    walk = walker(seconds=max(count / 30, 8.0))
    poses = camera_poses(walk, side_camera(walk)).joints[:count].astype(np.float32)
    results: dict[str, Any] = {}
    for name, network in opened.items():
        _tell(f"{name}: start, single poses and live")
        results[name] = {
            "start_s": _start_s(network.path, placement().asked),
            "single_ms": _frame_ms(lambda pose, _, network=network: network.rotation(pose[None]), poses),
            "live_ms": _frame_ms(LiveRectifier(network).update, poses),
        }
    workers = next(iter(opened.values())).threads
    speeds: dict[str, list[float]] = {name: [] for name in opened}
    for turn in range(rounds):
        _tell(f"{count:,} poses, round {turn + 1} of {rounds}")
        for name, network in opened.items():
            speeds[name].append(len(poses) / took_s(partial(network.rotation, poses)))
    first = next(iter(opened))
    for name, values in speeds.items():
        results[name]["poses_per_s"] = float(np.median(values))
        if name != first:
            results[name]["times_the_first"] = float(np.median(np.divide(values, speeds[first])))
    return {
        "onnxruntime": onnxruntime.__version__, "threads": workers, "gemm_gflops": gemm_gflops(), "rectifiers": results,
    }  # fmt: skip


def as_text(results: dict[str, Any]) -> str:
    """A few lines for the terminal."""
    lines = [
        f"matrix products: {results['gemm_gflops']:.0f} GFLOP/s in float32; onnxruntime {results['onnxruntime']}, "
        f"{results['threads']} threads"
    ]
    for name, row in results["rectifiers"].items():
        text = f"{name}: {row['poses_per_s']:,.0f} poses/s"
        if "times_the_first" in row:
            text += f" ({row['times_the_first']:.2f} times {next(iter(results['rectifiers']))})"
        for kind, taken in (("a single pose", row["single_ms"]), ("live, a frame", row["live_ms"])):
            text += f"; {kind} {taken['p50']:.2f} ms (p50), {taken['p95']:.2f} ms (p95)"
        lines.append(f"{text}; a new process's first pose after {row['start_s']:.2f} s")
    elsewhere = {name: device for name, device in results["device"]["networks"].items() if device != CPU}
    lines += [f"{name} computed on {device}; the products on the CPU" for name, device in elsewhere.items()]
    return "\n".join(lines)


def _open(name: str, threads: int | None) -> PCNetRectifier:
    network = load_rectifier(name)
    if not isinstance(network, PCNetRectifier):
        raise InputError(
            "bad-value",
            f"Expected a network to measure, got the rectifier '{name}'; give pcnet or an .onnx file.",
        )
    return PCNetRectifier(network.path, threads)


def _frame_ms(answer: Callable[[np.ndarray, float], object], poses: np.ndarray) -> dict[str, float]:
    """Of answer(pose (17, 3), its time in seconds), at 30 frames a second."""
    frames = (partial(answer, poses[number % len(poses)], number / 30) for number in range(_SINGLES))
    taken = [1000 * took_s(frame) for frame in frames]
    return {"p50": float(np.median(taken)), "p95": float(np.quantile(taken, 0.95))}


def _start_s(path: Path, device: str) -> float:
    """A fresh interpreter's imports, loading and first pose; the median of a few."""
    start = partial(subprocess.run, [sys.executable, "-c", _FIRST_POSE, str(path), device], check=True)
    return float(np.median([took_s(start) for _ in range(_STARTS)]))


def _tell(text: str) -> None:
    print(text, file=sys.stderr)
