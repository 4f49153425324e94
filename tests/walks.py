"""Files of the example's person on a treadmill, as long as a test wants."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_keypoints, write_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.reading.settings import RunOptions


def of_poses(folder: Path, frames: int) -> RunOptions:
    """A run on poses and keypoints of so many frames, which are written into the folder."""
    walk, camera = walker(seconds=frames / 30), side_camera(walker())
    walk = replace(walk, world=walk.world - walk.root[:, None] + walker().root[-1])
    poses, keypoints = folder / "X3D.npy", folder / "alphapose-results.json"
    rows, rng = np.arange(frames), np.random.default_rng(0)
    write_keypoints(keypoints, walk, camera, rows, 1.0, rng)
    write_poses(poses, walk, camera, rows, 0.008, rng)
    return RunOptions(poses=poses, keypoints=keypoints, fps=30, image_size=(camera.width, camera.height))
