"""Poses to measure a rectifier on: what swings, and what is defined otherwise."""

import numpy as np
import pytest

from golden.bodies import bone_lengths
from pcnet3d.models import load_rectifier
from pcnet3d.models.lab.synthetic.sample_poses import redefined, sample_poses, swing
from pcnet3d.models.lab.synthetic.views import seen, views
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.rotations import angle_deg


@pytest.fixture
def world(standing):
    """(80, 17, 3) of somebody who stands."""
    return (standing + np.random.default_rng(0).normal(0, 0.03, (80, 17, 3))).astype(np.float32)


def test_the_same_seed_gives_the_same_poses_of_people():
    poses = sample_poses(200)
    np.testing.assert_array_equal(poses, sample_poses(200))
    assert 0.001 < np.isnan(poses[..., 0]).mean() < 0.03
    assert np.isfinite(poses[:, H36M17.indices(("pelvis", "thorax", "l_hip", "r_shoulder"))]).all()
    assert 0.3 < np.nanmedian(bone_lengths(poses)[:, H36M17.bones.index(("l_knee", "l_ankle"))]) < 0.5
    height = np.linalg.norm(poses[:, H36M17.indices(("l_ankle", "r_ankle"))], axis=-1)
    assert np.nanmax(height) < 1.2
    assert np.nanstd(height) > 0.05  # some stand, some squat
    R, _ = load_rectifier("geometric").rotation(poses)
    left = poses[:, H36M17.index("l_shoulder")] - poses[:, H36M17.index("r_shoulder")]
    assert (np.einsum("ti,ti->t", R[:, :, 1], left) < 0).all()  # the left is at -y


def test_a_swing_bends_no_knee_and_stretches_no_limb(world):
    swung = swing(world, np.random.default_rng(0), 1.0)

    def knee(joints, side):
        hip, at, ankle = (joints[:, H36M17.index(f"{side}_{part}")] for part in ("hip", "knee", "ankle"))
        return angle_deg(hip - at, ankle - at)

    assert np.abs(swung - world).max() > 0.1
    np.testing.assert_allclose(knee(swung, "l"), knee(world, "l"), atol=1e-2)
    limbs = [i for i, bone in enumerate(H36M17.bones) if bone[0] not in ("spine",)]
    np.testing.assert_allclose(bone_lengths(swung)[:, limbs], bone_lengths(world)[:, limbs], atol=1e-4)
    np.testing.assert_allclose(swing(world, np.random.default_rng(0), 0.0), world, atol=1e-6)


def test_other_definitions_move_the_trunk_in_its_own_plane(standing):
    joints, _ = seen(np.tile(standing, (100, 1, 1)), views("wide", np.random.default_rng(0), 100))
    moved = redefined(joints, np.random.default_rng(1), 0.02)
    difference = moved - joints
    left = joints[:, H36M17.index("l_shoulder")] - joints[:, H36M17.index("r_shoulder")]
    rows = H36M17.indices(("spine", "thorax", "nose", "head"))
    assert np.abs(np.einsum("bji,bi->bj", difference[:, rows], left)).max() < 1e-6
    assert 0.01 < difference[:, rows].std() < 0.03
    assert np.delete(np.abs(difference), rows, axis=1).max() == 0
