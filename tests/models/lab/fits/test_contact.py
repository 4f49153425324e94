"""What contacts are learned from: takes of the bodies that were captured, runs weighed."""

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.metrics import relative
from pcnet3d.models.lab.fits.contact import floor_speed, true_takes
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.rotations import angle_deg, rotate
from pcnet3d.pipeline.reading.mocap.clip import Clip

PITCHED = np.array([[0.0, -1.0, 0.0], [0.3, 0.0, -0.954], [0.954, 0.0, 0.3]])


@pytest.fixture(scope="module")
def clip():
    walk = walker(seconds=3)
    return Clip("01_walk", "01", "walker", 30.0, walk.world.astype(np.float32))


def written(path, clip, truth):
    np.savez(path, lifted=truth, truth=truth, take_start=[0, len(clip)], clip=[clip.name])
    return path


def test_up_of_a_take_is_found_by_its_clip(clip, tmp_path):
    u, _, v = np.linalg.svd(PITCHED)
    R_camera_from_world = u @ v
    seen = rotate(R_camera_from_world, relative(clip.joints.astype(np.float64)))
    ((_, lifted, R),) = true_takes([written(tmp_path / "a.npz", clip, seen)], [clip])
    assert angle_deg(R[:, 2], R_camera_from_world.T[:, 2]) < 0.1
    np.testing.assert_allclose(lifted, seen, atol=1e-4)


@pytest.mark.parametrize("change", [(-1.0, 1.0, 1.0), (1.1, 1.1, 1.1)], ids=["mirrored", "taller"])
def test_takes_of_other_bodies_are_refused(clip, tmp_path, change):
    """Their sides and their up are not the clip's, by which contacts are told."""
    other = relative(clip.joints.astype(np.float64)) * change
    with pytest.raises(InputError, match="--bodies"):
        list(true_takes([written(tmp_path / "b.npz", clip, other)], [clip]))


def test_speed_over_the_floor():
    joints = np.zeros((90, len(H36M17), 3))
    joints[..., 0] = np.linspace(0, 9, 90)[:, None]
    joints[..., 2] = np.sin(np.arange(90))[:, None]  # up and down is not over the floor
    np.testing.assert_allclose(floor_speed(joints, 30.0), 9 / 89 * 30)
