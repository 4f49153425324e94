"""The walker seen by two cameras, each a finished run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import aimed, camera_poses, side_camera
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.pipeline import load_recipe
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe
from pcnet3d.pipeline.running.run import run_files
from pcnet3d.stages.study.compare.side import load_side


@pytest.fixture(scope="session")
def runs(walk, tmp_path_factory) -> Path:
    """A folder with the runs "side" (with TRC and C3D, 2D keypoints) and "front" of clean poses, 30 a second."""
    folder = tmp_path_factory.mktemp("compare")
    target = walk.root[-1] + 0.4 * (walk.root[0] - walk.root[-1])
    cameras = {"side": side_camera(walk), "front": aimed(target, 6.5, walk.heading_deg[-1] + 160, 8, -4)}
    stages = tuple(entry for entry in load_recipe().stages if entry.use != "report")
    recipe = Recipe(stages=stages).with_options("export", also=("trc", "c3d"))
    for i, (name, camera) in enumerate(cameras.items()):
        np.save(folder / f"{name}.npy", camera_poses(walk, camera).joints)
        flat = folder / f"{name}.json"
        write_keypoints(flat, walk, camera, np.arange(len(walk)), 0.5, np.random.default_rng(i))
        poses = folder / f"{name}.npy"
        sources = RunOptions(poses=poses, adapter="videopose3d", keypoints=flat, fps=30)
        run_files(sources, folder / name, recipe)
    return folder


@pytest.fixture(scope="module")
def sides(runs):
    """Without the doubt that a walker who stands still repeats rows."""
    loaded = [load_side(runs / name) for name in ("side", "front")]
    return [replace(side, run=side.run.with_(findings=())) for side in loaded]
