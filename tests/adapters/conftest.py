"""Fixtures shared by the adapters' tests."""

from collections.abc import Callable

import numpy as np
import pytest

from golden import bodies


@pytest.fixture
def turning() -> Callable[[int], np.ndarray]:
    """turning(T) -> (T, 17, 3) metres in CAMERA: the person turning on the spot, every frame different."""
    return bodies.turning


@pytest.fixture
def standing() -> Callable[[int], np.ndarray]:
    """standing(T) -> (T, 17, 3) metres, z up: the same person in a world, bobbing and walking off while turning."""
    return bodies.standing
