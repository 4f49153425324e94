"""Fixtures shared by the adapters' tests."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import rotate


@pytest.fixture
def turning(facing_camera: np.ndarray) -> Callable[[int], np.ndarray]:
    """turning(T) -> (T, 17, 3): the person of `facing_camera` turning on the spot, every frame different."""

    def frames(count: int) -> np.ndarray:
        angle_deg = 0.3 * np.arange(count)
        about_vertical = Rotation.from_rotvec(angle_deg[:, None] * [0, 1, 0], degrees=True).as_matrix()
        return rotate(about_vertical, facing_camera[None])

    return frames


@pytest.fixture
def standing(turning) -> Callable[[int], np.ndarray]:
    """standing(T) -> (T, 17, 3) metres, z up: the same person in a world, bobbing and walking off while turning."""

    def frames(count: int) -> np.ndarray:
        x, y, z = np.moveaxis(turning(count), -1, 0)
        walked = np.linspace(0, 1, count)[:, None]
        return np.stack([x + walked, z - 0.5 * walked, 0.9 + 0.03 * np.sin(9 * walked) - y], axis=-1)

    return frames
