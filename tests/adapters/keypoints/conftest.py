"""Fixtures shared by the tests of 2D files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from golden import detections


@pytest.fixture(scope="session")
def moving() -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """Frames and points of a person who drifts to the right; people of other numbers stand far away."""
    return detections.moving


@pytest.fixture
def write(tmp_path) -> Callable[[str, detections.Scene], Path]:
    """write(form, scene): a file, or a folder, of that form."""
    return lambda form, scene: detections.WRITERS[form](tmp_path, scene)
