"""What several looks at a person gain on the real take with truth:

    python tests/bench/bench_looks.py

By number of looks, means over its four cameras: keypoints of the 12 limb joints against the true ones as the camera
sees them, root mean square on x and y and frame-to-frame jitter (second difference), % of the body's box; and what the
built-in lifter makes of them, PA and rigid in mm, knee and elbow RMSE in degrees (as `evaluate --real-take`).
"""

from __future__ import annotations

import time

import numpy as np

from pcnet3d.models.detector.looks import MOST_LOOKS
from pcnet3d.models.lab.evaluation.real_data import (
    LIMBS,
    MOVING,
    exact_keypoints,
    found_keypoints,
    openpose_keypoints,
    read_cameras,
    read_truth,
)
from pcnet3d.models.lab.evaluation.real_take import lift_row
from pcnet3d.models.lab.mocap.clips import data_folder
from pcnet3d.models.lifter.builtin import lift
from pcnet3d.pipeline.core.layouts import COCO17, H36M17, remap
from pcnet3d.pipeline.files.video_frames import shown_size
from pcnet3d.pipeline.reading.load import read_video


def rows(looks: int) -> list[dict[str, float]]:
    """A row for every camera."""
    folder = data_folder() / "real" / MOVING
    cameras = read_cameras(folder)
    truth = read_truth(folder, list(cameras))
    limbs = COCO17.indices(LIMBS)
    found = []
    for name, camera in cameras.items():
        video = read_video(camera.video)
        start = time.perf_counter()
        keypoints = found_keypoints(video, looks)
        took = time.perf_counter() - start
        given = openpose_keypoints(truth.openpose[name], video.time_s)
        exact = exact_keypoints(camera, truth.limbs, given).joints[keypoints.frame_index][:, limbs]
        box = np.ptp(exact, axis=1).max(axis=-1)[:, None, None]
        off = 100 * (keypoints.joints[:, limbs] - exact) / box
        poses = lift(remap(keypoints, H36M17), shown_size(video))
        row = lift_row(poses, truth.limbs[poses.frame_index])
        found.append(
            {
                "2D rms, %": float(np.sqrt(np.mean(off**2))),
                "2D jitter, %": float(np.sqrt(np.mean(np.diff(off, 2, axis=0) ** 2))),
                "PA, mm": row["pa_mm"],
                "rigid, mm": row["rigid_mm"],
                "knee": row["knee_flexion"]["rmse"],
                "elbow": row["elbow_flexion"]["rmse"],
                "ms an image": 1000 * took / len(video.time_s),
            }
        )
    return found


if __name__ == "__main__":
    for looks in range(1, MOST_LOOKS + 1):
        each = rows(looks)
        print(
            looks, {key: round(float(np.mean([row[key] for row in each])), 1) for key in each[0]}, flush=True
        )
