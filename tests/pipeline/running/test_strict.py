"""`pcnet3d run --strict`: an exit code that says how far a run can be trusted."""

import json

import numpy as np
import pytest

from commands import pcnet3d, recipe_of
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker


@pytest.fixture(scope="module")
def joints() -> np.ndarray:
    """(T, 17, 3) of the walker before a camera, until she stands still, digit for digit."""
    walk = walker(seconds=4)
    return camera_poses(walk, side_camera(walk)).joints[:54]


def _repeated(joints):
    joints[10:40:3] = joints[9:39:3]
    return joints


CHANGES = {
    "none": lambda joints: joints,
    "repeated": _repeated,
    "flat": lambda joints: joints * [1, 1, 1e-3],
    "lying": lambda joints: joints[..., [1, 0, 2]] * [1, -1, 1],
    "short": lambda joints: joints[:5],
}


@pytest.fixture
def run(joints, tmp_path):
    """run(change, *words): exit code, the line about trust and the folder."""

    def call(change, *words: str):
        np.save(tmp_path / "poses.npy", CHANGES[change](joints.copy()))
        recipe = recipe_of(tmp_path / "quick.toml", "rectify", "trajectories", "export")
        out = tmp_path / "out"
        given = ["--poses", tmp_path / "poses.npy", "--adapter", "videopose3d", "--fps", 30, "-o", out]
        done = pcnet3d("run", *given, f"--recipe={recipe}", *words)
        assert out.is_dir(), done.stderr
        return done.returncode, done.stdout.splitlines()[1].removesuffix("."), out

    return call


@pytest.mark.parametrize(
    ("change", "code"), [("none", 0), ("repeated", 3), ("flat", 4), ("lying", 3), ("short", 4)]
)
def test_strict_tells_by_the_exit_code_and_without_it_the_result_does(run, change, code, tmp_path):
    ended, last, out = run(change, "--strict", "--set=read.handedness=ignore")
    assert ended == code
    if change in ("none", "repeated", "flat"):  # whose faults are in the file, where inspect sees them
        assert pcnet3d("inspect", tmp_path / "poses.npy", "--adapter", "videopose3d").returncode == code
    assert code == 0 or last.endswith(f"(exit code {code}, as --strict asks)")
    files = sorted(path.name for path in out.iterdir())
    ended, last, out = run(change, "--set=read.handedness=ignore")
    assert ended == 0
    assert code == 0 or last.endswith(f"(--strict makes the exit code {code})")
    assert sorted(path.name for path in out.iterdir()) == files  # the results are there in any case
    level_ok = json.loads((out / "summary.json").read_text())["rectification"]["level_ok"]
    assert level_ok == (change != "short")
