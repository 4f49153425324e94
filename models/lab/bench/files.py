"""Where time and memory go from an estimator's files to all results, without a video:  pcnet3d lab bench files"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....examples.walker import side_camera, walker
from ....examples.walker.files import write_keypoints, write_poses
from ....pipeline.reading.settings import OnDevice, RunOptions
from ..common.modules import in_own_process
from .run import Measured, gemm_gflops, measured_run, took_s

# H36M17, camera axes, metres: somebody who stands upright and faces the camera.
_BODY = np.array(
    [[0, 0, 0], [-0.1, 0, 0], [-0.1, 0.4, -0.05], [-0.1, 0.85, 0], [0.1, 0, 0], [0.1, 0.4, -0.05], [0.1, 0.85, 0],
     [0, -0.25, 0], [0, -0.5, 0], [0, -0.6, -0.1], [0, -0.7, 0], [0.18, -0.45, 0], [0.2, -0.2, 0],
     [0.2, 0, -0.1], [-0.18, -0.45, 0], [-0.2, -0.2, 0], [-0.2, 0, -0.1]]
)  # fmt: skip
_START = {
    "a Python that does nothing": "pass",
    "import pcnet3d.stages": "import pcnet3d.stages",
    "pcnet3d --help": "import sys; sys.argv[1:] = ['--help']; from pcnet3d.pipeline.cli import main; main()",
}


def files(
    frames: Annotated[int, typer.Option(min=100, help="Frames of the take.")] = 10_000,
    walks: Annotated[
        bool,
        typer.Option(
            "--walks", help="Use a person who walks and give the image's size; keypoints are then lifted too."
        ),
    ] = False,
    device: OnDevice = "auto",
) -> None:
    """Measure a run on files of poses and keypoints: every stage, the memory, and how long a command takes to start."""
    with tempfile.TemporaryDirectory() as folder:
        written = write_walk(Path(folder), frames) if walks else write_inputs(Path(folder), frames)
        print(in_own_process(_run, written.with_(device=device)))
    print(f"matrix products: {gemm_gflops():.0f} GFLOP/s in float32")
    for what, code in _START.items():
        start = partial(subprocess.run, [sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)
        print(f"{what}: {took_s(start):.2f} s")


def write_inputs(folder: Path, frames: int) -> RunOptions:
    """Files of MotionBERT and AlphaPose in this folder: a body that sways, and keypoints at random."""
    rng = np.random.default_rng(0)
    time_s = np.arange(frames) / 30
    sway = 0.1 * np.sin(2 * np.pi * time_s)[:, None, None] * rng.normal(size=(17, 3))
    moved = _BODY + 0.2 * sway * (np.arange(17) > 0)[:, None] + [0.05, 0.05, 0]
    poses, keypoints = folder / "X3D.npy", folder / "alphapose-results.json"
    np.save(poses, moved.astype(np.float32))
    detections = [
        {"image_id": f"{i}.jpg", "category_id": 1, "keypoints": rng.uniform(0, 500, 51).round(3).tolist(), "score": 3.0,
         "box": [0, 0, 100, 200], "idx": 1}
        for i in range(frames)
    ]  # fmt: skip
    keypoints.write_text(json.dumps(detections), encoding="utf-8")
    return RunOptions(poses=poses, keypoints=keypoints, fps=30)


def write_walk(folder: Path, frames: int) -> RunOptions:
    """The same files of the built-in walker on a treadmill."""
    walk, camera = walker(seconds=frames / 30), side_camera(walker())
    walk = replace(walk, world=walk.world - walk.root[:, None] + walker().root[-1])
    poses, keypoints = folder / "X3D.npy", folder / "alphapose-results.json"
    rows, rng = np.arange(frames), np.random.default_rng(0)
    write_keypoints(keypoints, walk, camera, rows, 1.0, rng)
    write_poses(poses, walk, camera, rows, 0.008, rng)
    return RunOptions(poses=poses, keypoints=keypoints, fps=30, image_size=(camera.width, camera.height))


def _run(options: RunOptions) -> Measured:
    return measured_run(options)[1]
