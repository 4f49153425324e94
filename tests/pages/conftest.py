"""The files that the pages speak of, all of the walker."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from golden import lifters, numbered, sensors, worlds
from golden.strapped import Faults, strapped
from golden.trainings import tiny
from pages.blocks import text_of
from pcnet3d.examples.demo import demo
from pcnet3d.examples.walker.camera import Camera, camera_poses, side_camera
from pcnet3d.examples.walker.files import write_keypoints, write_poses
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.models.lab.data import data
from pcnet3d.pipeline import H36M17

# Packages of others that documents use, whose answers have the shapes and types of theirs; and a lifter.
STAND_INS = {
    "seen.py": """
import sys
sys.path.append("TESTS")
import numpy as np
from golden import numbered
JOINTS = numbered.joints_px()
def people(image):  # (1, 17, 2) and (1, 17), of an image in BGR
    assert image.dtype == np.uint8 and image.shape == (numbered.HEIGHT, numbered.WIDTH, 3)
    number = round((float(image[4:14, 4:14].mean()) - 8) / numbered.STEP)
    return JOINTS[None, number], np.full((1, 17), 0.9, np.float32) - JOINTS[None, number, :, 0] / 1e4
""",
    "rtmlib.py": """
from seen import people
class Body:
    def __call__(self, image):
        return people(image)
""",
    "ultralytics.py": """
from types import SimpleNamespace
import numpy as np
import torch
from seen import people
class YOLO:
    def __init__(self, weights):
        assert weights.endswith("-pose.pt")
    def __call__(self, image, verbose=True):
        data = torch.tensor(np.dstack(people(image)))
        return [SimpleNamespace(keypoints=SimpleNamespace(data=data))]
""",
    "my_lifter.py": """
import torch
from pcnet3d.examples.walker import camera_poses, side_camera, walker
class Lifter(torch.nn.Module):
    def forward(self, xy):
        assert xy.shape == (1, 60, 17, 2) and xy.abs().max() < 1
        walk = walker(seconds=2)
        return torch.tensor(camera_poses(walk, side_camera(walk)).joints)[None]
""",
}
SUBJECTS = ("01", "02", "05", "07", "09")


@pytest.fixture(scope="session")
def files(tmp_path_factory) -> Path:
    """A folder with a recording of 2 s and a detector for it, motion capture, sensors, and the demo's results."""
    folder = tmp_path_factory.mktemp("pages")
    walk = walker(seconds=2)
    camera, rng, rows = side_camera(walk), np.random.default_rng(0), np.arange(len(walk))
    shutil.copy(numbered.numbered_film(folder / "stream.ts"), folder / "video.mp4")
    numbered.toy_detector(folder / "movenet.onnx")
    write_keypoints(folder / "alphapose-results.json", walk, camera, rows, 1.0, rng)
    write_poses(folder / "X3D.npy", walk, camera, rows, 0.008, rng)
    np.savez(folder / "joints.npz", joints=camera_poses(walk, camera).joints)
    for name, text in STAND_INS.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text.replace("TESTS", str(Path(numbered.__file__).parents[1])))
    _two_people(folder, walk, camera)
    _motion_capture(folder)
    _finished(folder)
    (folder / "manifest.csv").write_text(text_of("visits", "csv"))
    for name in ("anna-1.npy", "anna-2.npy", "before.npy", "after.npy"):
        shutil.copy(folder / "X3D.npy", folder / name)
    shutil.copy(folder / "video.mp4", folder / "before.mp4")
    shutil.copy(numbered.numbered_film(folder / "later.ts", crf="13"), folder / "after.mp4")  # another file
    return folder


def _two_people(folder: Path, walk: Walk, camera: Camera) -> None:
    """results_walk.json of MMPose's demo."""
    second = walker(seconds=2, stature_m=1.6, turn_deg=30)
    people = [camera_poses(one, camera).joints for one in (walk, second)]
    frames = [
        [
            lifters.instance(lifters.as_mmpose(joints[i]), lifters.box_of(n, i))
            for n, joints in enumerate(people)
        ]
        for i in range(len(walk))
    ]
    lifters.mmpose3d(folder, frames, "demo")


def _motion_capture(folder: Path) -> None:
    """FOLDER, of BVH; own, the data folder made of it; and own.toml, a training on that."""
    (folder / "FOLDER").mkdir()
    for i, name in enumerate(SUBJECTS):
        world = walker(seconds=2, turn_deg=10.0 * i).world
        worlds.bvh(folder / "FOLDER" / f"{name}_walk.bvh", worlds.y_up(world), fps=30)
    data(folder / "own", own=folder / "FOLDER")
    (folder / "own" / "splits.json").write_text(text_of("training", "json"))
    (folder / "own.toml").write_text(tiny())


def _finished(folder: Path) -> None:
    """The demo's results, twice more as visits, its truth as a TRC, and the sensors that its walker wore."""
    demo(folder / "results")
    for visit in ("visit-1", "visit-2"):
        shutil.copytree(folder / "results", folder / visit)
    walk = walker()
    points = walk.world[:, H36M17.indices(list(worlds.POSE2SIM.values()))]
    worlds.trc(folder / "trial.trc", worlds.POSE2SIM, worlds.y_up(points))
    for name, segment in {"wrist": "r_forearm", "r_forearm": "r_forearm", "pelvis": "pelvis"}.items():
        sensors.write_csv(folder / f"{name}.csv", strapped(walk, segment, Faults()))
