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
from hypothesis import settings

from golden import bodies, walks
from pcnet3d.examples.walker.camera import Camera, aimed, side_camera
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import Take

# How long one example takes says more about what else the machine does than about the code.
settings.register_profile("pcnet3d", deadline=None)
settings.load_profile("pcnet3d")

# What a shell starts in the background ignores Ctrl-C, and so would the commands that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real motion capture, lifter outputs and video; tests that need it skip without it."""
    folder = os.environ.get("PCNET3D_DATA")
    if not folder or not (Path(folder) / "README.md").exists():
        pytest.skip(f"no data at {folder}; set PCNET3D_DATA to the folder that has it")
    return Path(folder)


@pytest.fixture(scope="session")
def wheel(tmp_path_factory) -> Path:
    """The project as a wheel, built offline from a copy, for a build leaves files beside what it builds."""
    root, copy = Path(__file__).resolve().parents[1], tmp_path_factory.mktemp("wheel") / "pcnet3d"
    unwanted = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info", "demo-run*")
    shutil.copytree(root, copy, ignore=unwanted)
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PIP_"))}
    offline = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--wheel-dir", copy.parent)
    command = [sys.executable, "-m", "pip", "wheel", *offline, copy]
    built = subprocess.run(command, capture_output=True, text=True, env=clean, timeout=300)
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
