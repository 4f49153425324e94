"""Fixtures shared by all tests."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from golden import bodies

# How long one example takes says more about what else the machine does than about the code.
settings.register_profile("pcnet3d", deadline=None)
settings.load_profile("pcnet3d")


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real motion capture, lifter outputs and video; tests that need it skip without it."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("PCNET3D_DATA", default))
    if not (folder / "README.md").exists():
        pytest.skip(f"no data at {folder}; set PCNET3D_DATA to the folder that has it")
    return folder


@pytest.fixture
def facing_camera() -> np.ndarray:
    """(17, 3) metres, H36M17 in CAMERA, pelvis at the origin: an upright person who faces the camera."""
    return bodies.facing_camera()
