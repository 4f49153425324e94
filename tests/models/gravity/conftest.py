"""A person who stands, and one who is filmed."""

import numpy as np
import pytest

from golden.levelled import Filmed
from pcnet3d.pipeline import H36M17


@pytest.fixture(scope="module")
def seen() -> Filmed:
    return Filmed()


@pytest.fixture
def standing(facing_camera) -> np.ndarray:
    """(90, 17, 3) three seconds of standing with the feet 0.5 m apart, with a little noise."""
    joints = np.tile(facing_camera, (90, 1, 1))
    for side, sign in (("r", -1), ("l", 1)):
        joints[:, H36M17.index(f"{side}_ankle"), 0] = 0.25 * sign
    return joints + np.random.default_rng(0).normal(scale=0.002, size=joints.shape)
