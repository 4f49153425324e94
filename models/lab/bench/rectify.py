"""How fast a rectifier is on this machine, beside what its processor can do:  pcnet3d lab bench rectify"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import numpy as np
import typer

from ....examples.walker import camera_poses, side_camera, walker
from ....pipeline.core.device import CPU, computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many
from ....pipeline.reading.settings import OnDevice
from ...gravity.live import LiveRectifier
from ...rectifier.load import load_rectifier
from ...rectifier.onnx import PCNetRectifier
from .run import gemm_gflops, took_s

_POSES, _ROUNDS = 10_000, 5  # of which the median counts, for speeds of shared machines drift
_LIVE = 300  # frames


def rectify(
    rectifier: Annotated[str, typer.Option(help="A network by name, or its .onnx file.")] = "pcnet",
    device: OnDevice = "auto",
) -> None:
    """Measure a rectifier's speed beside the machine's own speed."""
    with computing_on(device) as where:
        results = {**measure(rectifier), "device": where.summary()}
    print(as_text(rectifier, results))


def measure(name: str) -> dict[str, Any]:
    """{"threads", "gemm_gflops", "poses_per_s", "live_ms": (p50, p95)}. InputError for a name that is no network."""
    network = load_rectifier(name)
    if not isinstance(network, PCNetRectifier):
        raise InputError(
            "bad-value",
            f"Expected a network to measure, got the rectifier '{name}'; give pcnet or an .onnx file.",
        )
    walk = walker(seconds=_POSES / 30)
    poses = camera_poses(walk, side_camera(walk)).joints[:_POSES].astype(np.float32)
    live = LiveRectifier(network)
    frames = (partial(live.update, poses[number % len(poses)], number / 30) for number in range(_LIVE))
    live_ms = [1000 * took_s(frame) for frame in frames]
    seconds = [took_s(partial(network.rotation, poses)) for _ in range(_ROUNDS)]
    return {
        "threads": network.threads,
        "gemm_gflops": gemm_gflops(),
        "poses_per_s": len(poses) / float(np.median(seconds)),
        "live_ms": np.quantile(live_ms, (0.5, 0.95)).tolist(),
    }


def as_text(name: str, results: dict[str, Any]) -> str:
    """A few lines for the terminal."""
    p50, p95 = results["live_ms"]
    lines = [
        f"matrix products: {results['gemm_gflops']:.0f} GFLOP/s in float32; {how_many(results['threads'], 'thread')}",
        f"{name}: {results['poses_per_s']:,.0f} poses/s; live, a frame {p50:.2f} ms (p50), {p95:.2f} ms (p95)",
    ]
    elsewhere = {name: device for name, device in results["device"]["networks"].items() if device != CPU}
    lines += [f"{name} computed on {device}; the products on the CPU" for name, device in elsewhere.items()]
    return "\n".join(lines)
