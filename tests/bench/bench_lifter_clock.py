"""What the lifter's clock is worth for frame rates and holes that its network was not trained on:

    python tests/bench/bench_lifter_clock.py [seed]

Validation takes of 3 to 17 s before wild cameras. Captured at 30 frames per second; other rates by a spline, so nothing
faster than 15 Hz is in them, and those below 24 by leaving rows out. Holes: joints or rows left out at random. MPJPE in
mm (one scale a take) and the error of the joints' velocities in mm/s: rows as they come, and by models/lifter/clock.py.
"""

from __future__ import annotations

import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from pcnet3d.models.common.metrics import scaled
from pcnet3d.models.lab.evaluation.testbed import see
from pcnet3d.models.lab.mocap.clips import read_clips
from pcnet3d.models.lifter import builtin
from pcnet3d.models.lifter.clock import Clock
from pcnet3d.pipeline import PoseSequence
from pcnet3d.pipeline.reading.mocap.clip import Clip

SECONDS = (3.0, 17.0)
# Frames per second of the camera, and of its rows every so manieth that is kept.
RATES = (
    (30, 15), (30, 6), (30, 3), (30, 2), (60, 3), (24, 1), (25, 1), (30, 1), (50, 1), (60, 1), (120, 1),
    (240, 1),
)  # fmt: skip
HOLES = (("joints", 0.1), ("joints", 0.3), ("rows", 0.1), ("rows", 0.3), ("rows", 0.5))


@dataclass(frozen=True, eq=False)
class Take:
    """truth: (T, 17, 3) metres, CAMERA axes, relative to the pelvis."""

    keypoints: PoseSequence
    image_size: tuple[int, int]
    truth: np.ndarray

    def every(self, step: int) -> Take:
        rows = np.arange(0, len(self.keypoints), step)
        kept = replace(
            self.keypoints,
            joints=self.keypoints.joints[rows],
            confidence=self.keypoints.confidence[rows],
            time_s=self.keypoints.times[rows],
            frame_index=rows,
        )
        return replace(self, keypoints=kept, truth=self.truth[rows])

    def without(self, what: str, share: float) -> Take:
        rng = np.random.default_rng(0)
        lost = rng.uniform(size=self.keypoints.joints.shape[: 2 if what == "joints" else 1]) < share
        joints = self.keypoints.joints.copy()
        joints[lost] = np.nan
        return replace(self, keypoints=self.keypoints.with_(joints=joints))

    def errors(self) -> tuple[float, float]:
        """MPJPE in mm, error of velocities in mm/s."""
        lifted = builtin.lift(self.keypoints, self.image_size).joints.astype(np.float64)
        there = np.isfinite(lifted).all((1, 2))
        off = scaled(lifted[there], self.truth[there], "take") - self.truth[there]
        seconds = np.diff(self.keypoints.times[there])[:, None]
        speed = np.linalg.norm(np.diff(off, axis=0), axis=-1) / seconds
        return 1000 * float(np.linalg.norm(off, axis=-1).mean()), 1000 * float(speed.mean())


def take_of(clip: Clip, fps: float, seed: int) -> Take:
    moments = np.arange(int((len(clip) - 1) / clip.fps * fps) + 1) / fps
    joints = CubicSpline(np.arange(len(clip)) / clip.fps, clip.joints.astype(np.float64))(moments)
    shown = see(replace(clip, fps=fps, joints=joints.astype(np.float32)), seed)
    return Take(shown.keypoints, shown.image_size, shown.truth)


@contextmanager
def rows_as_they_come() -> Iterator[None]:
    clock = builtin.clock_of
    builtin.clock_of = lambda rate, rows: Clock(finer=1, phases=(1,), longest=0)
    try:
        yield
    finally:
        builtin.clock_of = clock


def told(words: str, takes: list[Take]) -> None:
    with rows_as_they_come():
        before = np.mean([take.errors() for take in takes], axis=0)
    after = np.mean([take.errors() for take in takes], axis=0)
    print(f"{words}: {before[0]:.1f}, {before[1]:.0f} -> {after[0]:.1f}, {after[1]:.0f}", flush=True)


def main() -> None:
    seed = int(sys.argv[1]) if len(sys.argv) > 1 else 0
    clips = [clip for clip in read_clips("val") if SECONDS[0] <= len(clip) / clip.fps <= SECONDS[1]]
    clips = [clip for clip in clips if zlib.crc32(clip.name.encode()) % 3 == 0]
    print(f"{len(clips)} takes: MPJPE in mm, error of velocities in mm/s, rows as they come -> by the clock")
    for fps, step in RATES:
        told(f"{fps / step:g} a second", [take_of(clip, fps, seed).every(step) for clip in clips])
    usual = [take_of(clip, 30.0, seed) for clip in clips]
    for what, share in HOLES:
        told(f"{100 * share:g} % of {what} lost", [take.without(what, share) for take in usual])


if __name__ == "__main__":
    main()
