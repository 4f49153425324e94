"""Fixtures shared by all tests."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from pcnet3d.pipeline import H36M17

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
    """(17, 3) metres, H36M17 in CAMERA, pelvis at the origin: an upright person who faces the camera.

    Right-handed and anatomical: the right hip at smaller x, knees and nose towards the camera (-z).
    """
    joints = {
        "pelvis": (0.0, 0.0, 0.0),
        "r_hip": (-0.10, 0.01, 0.0),
        "r_knee": (-0.11, 0.44, -0.06),
        "r_ankle": (-0.11, 0.87, 0.02),
        "spine": (0.0, -0.24, 0.01),
        "thorax": (0.0, -0.49, 0.0),
        "nose": (0.0, -0.60, -0.09),
        "head": (0.0, -0.75, -0.01),
        "r_shoulder": (-0.18, -0.46, 0.0),
        "r_elbow": (-0.22, -0.18, 0.03),
        "r_wrist": (-0.21, 0.05, -0.05),
    }
    joints |= {
        name.replace("r_", "l_"): (-x, y, z) for name, (x, y, z) in joints.items() if name.startswith("r_")
    }
    return np.array([joints[name] for name in H36M17.joints])
