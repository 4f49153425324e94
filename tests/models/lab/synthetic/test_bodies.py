"""Other proportions: bone lengths change, joint angles do not; the legs of one motion under another's upper body."""

import numpy as np
import pytest
import torch

from golden.bodies import bone_lengths
from pcnet3d.models.lab.synthetic import bodies
from pcnet3d.models.lab.synthetic.bodies import BodyRange, mirror, resize
from pcnet3d.models.lab.synthetic.draw import NumpyDraw
from pcnet3d.pipeline import H36M17

BONES = np.array([H36M17.indices(bone) for bone in H36M17.bones])
LOWER = H36M17.indices(("pelvis", "l_hip", "r_hip", "l_knee", "r_knee", "l_ankle", "r_ankle"))
UPPER = [i for i in range(17) if i not in LOWER]


@pytest.fixture
def joints(rng):
    return rng.normal([2.0, 1.0, 0.9], 0.5, (6, 9, 17, 3))


def directions(joints):
    bones = joints[..., BONES[:, 1], :] - joints[..., BONES[:, 0], :]
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


def test_bones_change_by_their_factors_and_keep_their_directions(joints, rng):
    factors = bodies.drawn_factors(torch.from_numpy(joints), NumpyDraw(rng), BodyRange()).numpy()
    resized = resize(joints, factors)
    np.testing.assert_allclose(directions(resized), directions(joints), atol=1e-9)
    ratio = bone_lengths(resized) / bone_lengths(joints)
    np.testing.assert_allclose(ratio, np.broadcast_to(factors[:, None, BONES[:, 1]], ratio.shape))
    assert ratio.std(axis=0).min() > 0.03
    np.testing.assert_array_equal(factors, factors[:, H36M17.mirror])  # limbs of both sides alike
    left, right = H36M17.indices(("l_wrist", "r_wrist"))
    np.testing.assert_allclose(mirror(joints)[..., left, :], joints[..., right, :] * [-1, 1, 1])


def test_longer_legs_keep_the_feet_on_the_floor(standing):
    upright = np.tile(standing, (1, 2, 1, 1))
    upright[..., 2] -= upright[..., H36M17.index("l_ankle"), 2].min()
    factors = np.ones((1, 17))
    factors[:, H36M17.indices(("l_knee", "r_knee", "l_ankle", "r_ankle"))] = 1.2
    ankle, pelvis = H36M17.index("l_ankle"), H36M17.index("pelvis")
    resized = resize(upright, factors)
    np.testing.assert_allclose(resized[..., ankle, 2], upright[..., ankle, 2], atol=0.02)
    np.testing.assert_allclose(resized[..., pelvis, 2], 1.2 * upright[..., pelvis, 2], atol=0.02)


def test_combined_motions_keep_the_legs_of_one_and_the_arms_of_the_other(joints, rng):
    def with_hips(joints, heading_deg):
        """Joints whose hip axis is level and points that way."""
        out, angle = joints.copy(), np.radians(heading_deg)
        for name, sign in (("l_hip", 0.1), ("r_hip", -0.1)):
            out[..., H36M17.index(name), :] = out[..., 0, :] + sign * np.array(
                [np.cos(angle), np.sin(angle), 0]
            )
        return out

    def combined(lower, upper):
        return bodies.combine(*(torch.from_numpy(np.ascontiguousarray(x)) for x in (lower, upper))).numpy()

    lower, upper = with_hips(joints, 20), with_hips(rng.normal(0, 0.5, joints.shape), 110)
    out = combined(lower, upper)
    np.testing.assert_array_equal(out[..., LOWER, :], lower[..., LOWER, :])
    # The other motion's hips point 90 degrees further, so its upper body turns by -90 about the vertical.
    x, y, z = np.moveaxis((upper - upper[..., :1, :])[..., UPPER, :], -1, 0)
    np.testing.assert_allclose(out[..., UPPER, :] - out[..., :1, :], np.stack([y, -x, z], -1), atol=1e-9)
    lying = with_hips(joints, 0)
    lying[:, 4, H36M17.index("l_hip")] = lying[:, 4, 0] + [0.0, 0.0, 0.5]  # hips without a heading
    np.testing.assert_array_equal(combined(lying, with_hips(joints[::-1], 0)), lying)
