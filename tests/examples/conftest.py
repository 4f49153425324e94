"""The built-in example, made once a file of tests."""

import pytest

from pcnet3d.examples.walker.camera import Camera, side_camera
from pcnet3d.examples.walker.walk import Walk


@pytest.fixture(scope="module")
def camera(walk: Walk) -> Camera:
    return side_camera(walk)
