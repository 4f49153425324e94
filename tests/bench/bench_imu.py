"""Prints how near the accelerations of a lifted walker are to those of simulated inertial sensors, by smoother:

    python tests/bench/bench_imu.py

The built-in walker before five cameras, as people film, with detectors' noise; lifted, and levelled with one gravity.
Sensors on forearm and foot with noise, bias, mounting, lag and heading of their own, less one on the pelvis; 6 Hz on
both sides. RMSE in m/s^2 of one axis and r, over cameras and both sides of the body.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.spread import stated_spread
from pcnet3d.models.gravity import Seen, level_static
from pcnet3d.models.lab.evaluation.acceleration import NO_MOTION, agreement, filtered
from pcnet3d.models.lab.evaluation.take_answers import joints_of
from pcnet3d.models.lab.evaluation.testbed import BEDS, see
from pcnet3d.models.lifter.builtin import lift
from pcnet3d.models.rectifier.load import load_rectifier
from pcnet3d.models.smoother import known_noise
from pcnet3d.pipeline.core.frames import turned_covariance
from pcnet3d.pipeline.core.rotations import is_finite, rotate, turned
from pcnet3d.pipeline.reading.mocap.clip import Clip
from pcnet3d.pipeline.signals.filters import CUTOFF_HZ
from pcnet3d.pipeline.signals.imu import point_on
from pcnet3d.stages.study.imu.align import align
from pcnet3d.stages.study.imu.motion import even_times, imu_signal, path_acceleration

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from golden.strapped import strapped

CAMERAS, SEARCH_S = 5, 0.5
SEGMENTS = {"forearm": ("r_forearm", "l_forearm"), "foot": ("r_foot", "l_foot")}


def smoothed(seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times (T,) and, by smoother, the walker's levelled joints (T, 17, 3) in metres from the pelvis."""
    walk = walker()
    seen = see(
        Clip("walker", "walker", "walker", walk.fps, walk.world.astype(np.float32)),
        seed,
        views=BEDS["typical"],
    )
    poses = lift(seen.keypoints, seen.image_size)
    joints = joints_of(poses, seen.truth)
    scale = np.linalg.norm(joints) / np.linalg.norm(poses.joints)
    level = level_static(
        Seen(joints, *load_rectifier("pcnet").rotation(joints), poses.times, spread=stated_spread(poses))
    )
    R_level_from_camera = level.R_camera_from_level.T
    path = rotate(R_level_from_camera, joints)
    covariance = turned_covariance(poses.covariance, R_level_from_camera, scale)
    paths = {f"Butterworth {hz:g} Hz": filtered(path, poses.times, hz) for hz in (CUTOFF_HZ, 3.0)}
    return poses.times, paths | {
        "known noise": known_noise(path, poses.times, covariance, lifted=True).values[0]
    }


def main() -> None:
    """Prints the table."""
    walk, found = walker(), {}
    pelvis = imu_signal(strapped(walk, "pelvis"), None, CUTOFF_HZ)
    for seed in range(CAMERAS):
        time_s, paths = smoothed(seed)
        grid = even_times(time_s, CUTOFF_HZ)
        for kind, segments in SEGMENTS.items():
            for segment in segments:
                sensor = imu_signal(strapped(walk, segment, seed=seed), pelvis, CUTOFF_HZ)
                videos = {
                    name: path_acceleration(point_on(segment, path), time_s, (), grid, CUTOFF_HZ)
                    for name, path in paths.items()
                }
                best = align(grid, videos["known noise"], sensor, SEARCH_S)
                felt = turned(sensor(best.imu_time(grid)), best.heading_deg)
                for name, video in {NO_MOTION: 0 * felt, **videos}.items():
                    both = is_finite(felt) & is_finite(video)
                    found.setdefault((name, kind), []).append(agreement(video[both], felt[both]))
    print(f"| | {' | '.join(SEGMENTS)} |\n| --- |{' --- |' * len(SEGMENTS)}")
    for name in dict.fromkeys(name for name, _ in found):
        rows = (np.mean(found[name, kind], axis=0) for kind in SEGMENTS)
        cells = [f"{rmse:.2f}" + (f"; r {r:.2f}" if np.isfinite(r) else "") for rmse, r in rows]
        print(f"| {name} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
