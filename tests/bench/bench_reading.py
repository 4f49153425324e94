"""Memory of reading an hour of MMPose: `python tests/bench/bench_reading.py [MINUTES]`. Prints; asserts nothing.

A generated JSON at 60 frames a second, as Pose3DInferencer writes it, of one person and of two, through `read_all`: the
peak of Python's and numpy's allocations over the size of the arrays that come out.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path

from pcnet3d.adapters import read_all
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import PoseSequence

_CLIP = 600  # frames that are written over and over


def write(path: Path, frames: int, people: int) -> None:
    """The walker, seen from behind, as the inferencer writes a lifted person: x left, y away, z up, on the floor."""
    body = walker(fps=60, seconds=_CLIP / 60).world[:, :, [1, 0, 2]]
    body = body - [0, 0, 1] * body[..., 2].min(axis=1)[:, None, None]
    clip = [
        json.dumps(
            [
                {
                    "keypoints": joints,
                    "keypoint_scores": [1.0] * 17,
                    "bbox": [[left, 50.0, left + 200, 700.0]],
                }
                for left in range(100, 100 + 400 * people, 400)
            ]
        )
        for joints in body.tolist()
    ]
    with path.open("w", encoding="utf-8") as file:
        for frame in range(frames):
            file.write(
                f'{"," if frame else "["}{{"frame_id": {frame}, "instances": {clip[frame % len(clip)]}}}'
            )
        file.write("]")


def size(people: tuple[PoseSequence, ...]) -> int:
    arrays = [
        array
        for poses in people
        for array in (poses.joints, poses.confidence, poses.frame_index, poses.time_s)
    ]
    return sum(array.nbytes for array in arrays if array is not None)


def main() -> None:
    frames = int(float(sys.argv[1]) * 3600) if len(sys.argv) > 1 else 60 * 3600
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.json"
        for people in (1, 2):
            write(path, _CLIP, people)
            read_all(path)  # loads the adapters, which is no part of it
            write(path, frames, people)
            tracemalloc.start()
            start = time.perf_counter()
            found = read_all(path, fps=60)
            seconds = time.perf_counter() - start
            _, peak = tracemalloc.get_traced_memory()
            tracemalloc.stop()
            print(
                f"{frames} frames of {len(found)}, {path.stat().st_size / 2**20:.0f} MB of JSON: "
                f"peak {peak / 2**20:.0f} MB, arrays {size(found) / 2**20:.0f} MB, {peak / size(found):.2f} times; "
                f"{seconds:.0f} s"
            )
            del found
    print(f"peak resident memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
