"""Fixtures shared by all tests."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

from golden import bodies, walks
from pcnet3d.examples.walker.camera import Camera, aimed, side_camera
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import Take
from pcnet3d.pipeline.core.system import cores_given

# How long an example takes says more about what else the machine does than about the code.
settings.register_profile("pcnet3d", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("pcnet3d")

# What a shell starts in the background ignores Ctrl-C, and so would the commands that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

# What tests marked `data` read.
DATA = Path(os.environ.get("PCNET3D_DATA", Path(__file__).with_name("data"))).absolute()


def pytest_configure() -> None:
    """Refuses a folder without data: less would be tested than was meant."""
    if not (DATA / "cmu_mocap.npz").is_file():
        raise pytest.UsageError(
            f"Expected cmu_mocap.npz in PCNET3D_DATA={DATA}; name the data folder, or unset it."
        )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Of `-n auto`: one more than cores, for tests of commands wait for these; up to four of 2 GB."""
    return min(cores_given() + 1, 4)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test marked `data` finds real data in the folder PCNET3D_DATA: the one that the user named so, or the sample of
    motion capture in tests/data. The mark's arguments are what else of the folder it needs; without them it skips. All
    other tests have no PCNET3D_DATA, as most machines have none, so that a mark that lacks fails everywhere."""
    os.environ.pop("PCNET3D_DATA", None)
    marks = list(item.iter_markers("data"))
    assert marks or "data" not in item.fixturenames, "Mark the test `data`."
    lacking = [name for mark in marks for name in mark.args if not (DATA / name).exists()]
    if lacking:
        pytest.skip(f"set PCNET3D_DATA to a folder with {', '.join(lacking)}")
    if marks:
        os.environ["PCNET3D_DATA"] = str(DATA)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder that tests marked `data` read (pytest_runtest_setup)."""
    return Path(os.environ["PCNET3D_DATA"])


@pytest.fixture(scope="session")
def wheel(tmp_path_factory) -> Path:
    """The project as a wheel, built offline from a copy, for a build leaves files beside what it builds."""
    root, copy = Path(__file__).resolve().parents[1], tmp_path_factory.mktemp("wheel") / "pcnet3d"
    unwanted = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info", "demo-run*")
    shutil.copytree(root, copy, ignore=unwanted)
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PIP_"))}
    offline = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--wheel-dir", copy.parent)
    command = [sys.executable, "-m", "pip", "wheel", *offline, copy]
    built = subprocess.run(command, capture_output=True, text=True, env=clean)
    assert built.returncode == 0, built.stdout + built.stderr
    return next(copy.parent.glob("*.whl"))


@pytest.fixture
def save(tmp_path) -> Callable[..., Path]:
    """save(array, name="poses.npy"): its file."""

    def write(array: np.ndarray, name: str = "poses.npy") -> Path:
        np.save(tmp_path / name, array)
        return tmp_path / name

    return write


@pytest.fixture
def facing_camera() -> np.ndarray:
    """(17, 3) metres, H36M17 in CAMERA, pelvis at the origin: an upright person who faces the camera."""
    return bodies.facing_camera()


@pytest.fixture(scope="session")
def walk() -> Walk:
    """The built-in walker."""
    return walker()


@pytest.fixture(scope="session")
def camera(walk: Walk) -> Camera:
    """Beside the built-in walker."""
    return side_camera(walk)


@pytest.fixture(scope="session")
def filmed() -> Take:
    """Three seconds of the walker's body before a tilted camera whose focal length is given, with exact keypoints."""
    walk = walker(seconds=3)
    camera = aimed(walk.root.mean(axis=0), 6, heading_deg=60, pitch_deg=10, roll_deg=3)
    return walks.filmed(walk, camera, focal_share=0.0)
