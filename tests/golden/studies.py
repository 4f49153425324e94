"""Studies to run in a batch: files of poses, a manifest, and a package whose stages crash, hang, or cost next to
nothing."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from golden import lifters
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker

_QUICK = ("scale", "rectify", "trajectories", "angles", "measures", "export")
_STAGES = """
import os, time


class Crash:
    name, needs, gives = "crash", (), ()

    def __call__(self, take):
        os.abort()


class Hang:
    name, needs, gives = "hang", (), ()

    def __call__(self, take):
        time.sleep(1e6)

"""


def write_trouble(folder: Path, version: str = "1.0") -> Path:
    """A folder for PYTHONPATH: an installed package with the stages `crash` and `hang`."""
    told = folder / f"trouble-{version}.dist-info"
    told.mkdir(parents=True)
    (folder / "trouble.py").write_text(_STAGES)
    (told / "METADATA").write_text(f"Metadata-Version: 2.1\nName: trouble\nVersion: {version}\n")
    points = "[pcnet3d.stages]\ncrash = trouble:Crash\nhang = trouble:Hang\n"
    (told / "entry_points.txt").write_text(points)
    return folder


def write_study(
    folder: Path,
    good: int,
    broken: int = 0,
    crashing: int = 0,
    hanging: int = 0,
    stages: Sequence[str] = _QUICK,
) -> Path:
    """manifest.csv and its files: two visits of each subject, all of whose takes differ; recipes of those stages."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, trouble in (("quick", ()), ("crash", ("crash",)), ("hang", ("hang",))):
        recipe = "".join(
            f'[[stages]]\nuse = "{use}"\n' + 'rectifier = "geometric"\n' * (use == "rectify")
            for use in (*trouble, *stages)
        )
        (folder / f"{name}.toml").write_text(recipe)
    walk = walker(seconds=1.5)
    joints = 0.8 * camera_poses(walk, side_camera(walk)).joints
    kinds = ["good"] * good + ["broken"] * broken + ["crash"] * crashing + ["hang"] * hanging
    order = np.random.default_rng(0).permutation(len(kinds)) if broken else np.arange(len(kinds))
    rows = []
    for number, kind in enumerate(kinds[i] for i in order):
        poses = folder / f"take_{number:03}.npy"
        noise = np.random.default_rng(number).normal(scale=0.003, size=joints.shape)
        np.save(poses, (joints + noise).astype(np.float32))
        if kind == "broken":
            poses.write_bytes(poses.read_bytes()[:-1000])
        recipe = "quick" if kind in ("good", "broken") else kind
        rows.append(
            {
                "name": f"{kind}_{number:03}",
                "subject": f"s{number // 2}",
                "visit": ("first", "second")[number % 2],
                "poses": poses.name,
                "fps": 30,
                "recipe": f"{recipe}.toml",
            }
        )
    return write_manifest(folder / "manifest.csv", rows)


def write_pair(path: Path) -> Path:
    """Two people in every frame, as MMPose writes them."""
    walk = walker(seconds=1.5)
    bodies = lifters.as_mmpose(camera_poses(walk, side_camera(walk)).joints, rebase=False)
    frames = [[lifters.instance(body, lifters.box_of(place, 0)) for place in range(2)] for body in bodies]
    return lifters.mmpose3d(path.parent, frames).rename(path)


def write_manifest(path: Path, rows: list[dict[str, object]]) -> Path:
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return path
