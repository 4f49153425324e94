"""Speed and memory of the main job: `python tests/bench/bench_main_job.py [FRAMES]`. Prints; asserts nothing.

10,000 frames of a MotionBERT file and its AlphaPose file in, a recording and all result files out, no video.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.run import run_files


def write_inputs(folder: Path, frames: int) -> RunOptions:
    """A body that sways, as the files of an estimator."""
    rng = np.random.default_rng(0)
    time_s = np.arange(frames) / 30
    body = np.array(
        [[0, 0, 0], [-0.1, 0, 0], [-0.1, 0.4, -0.05], [-0.1, 0.85, 0], [0.1, 0, 0], [0.1, 0.4, -0.05], [0.1, 0.85, 0],
         [0, -0.25, 0], [0, -0.5, 0], [0, -0.6, -0.1], [0, -0.7, 0], [0.18, -0.45, 0], [0.2, -0.2, 0],
         [0.2, 0, -0.1], [-0.18, -0.45, 0], [-0.2, -0.2, 0], [-0.2, 0, -0.1]]
    )  # fmt: skip
    sway = 0.1 * np.sin(2 * np.pi * time_s)[:, None, None] * rng.normal(size=(17, 3))
    np.save(
        folder / "X3D.npy",
        (body + 0.2 * sway * (np.arange(17) > 0)[:, None] + [0.05, 0.05, 0]).astype(np.float32),
    )
    detections = [
        {"image_id": f"{i}.jpg", "category_id": 1, "keypoints": rng.uniform(0, 500, 51).round(3).tolist(), "score": 3.0,
         "box": [0, 0, 100, 200], "idx": 1}
        for i in range(frames)
    ]  # fmt: skip
    (folder / "alphapose-results.json").write_text(json.dumps(detections))
    return RunOptions(poses=folder / "X3D.npy", keypoints=folder / "alphapose-results.json", fps=30)


def seconds(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


def main() -> None:
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sources = write_inputs(folder, frames)
        shares: dict[str, float] = {}
        start = time.perf_counter()
        run_files(sources, folder / "out", done=lambda stage, took: shares.__setitem__(stage, took))
        total = time.perf_counter() - start
    print(f"{frames} frames, files in, recording out, no video: {total:.2f} s")
    for stage, took in shares.items():
        print(f"  {stage:<14} {took:6.2f} s  {100 * took / total:3.0f} %")
    print(f"peak resident memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    python = sys.executable
    print(f"python -c pass:                      {seconds([python, '-c', 'pass']):.2f} s")
    print(f"python -c 'import pcnet3d.pipeline': {seconds([python, '-c', 'import pcnet3d.pipeline']):.2f} s")
    print(
        f"pcnet3d --help:                      {seconds([str(Path(python).parent / 'pcnet3d'), '--help']):.2f} s"
    )


if __name__ == "__main__":
    main()
