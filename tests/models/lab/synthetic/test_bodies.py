"""Other proportions: bone lengths change, joint angles do not."""

import numpy as np
import pytest

from golden.bodies import bone_lengths
from pcnet3d.models.lab.synthetic.bodies import BodyRange, draw_factors, mirror, resize, size_m, vary
from pcnet3d.pipeline import H36M17

BONES = np.array([H36M17.indices(bone) for bone in H36M17.bones])


@pytest.fixture
def joints(rng):
    return rng.normal([2.0, 1.0, 0.9], 0.5, (6, 9, 17, 3))


def directions(joints):
    bones = joints[..., BONES[:, 1], :] - joints[..., BONES[:, 0], :]
    return bones / np.linalg.norm(bones, axis=-1, keepdims=True)


def test_bone_directions_stay(joints, rng):
    resized = resize(joints, draw_factors(joints, rng, BodyRange(unchanged=0)))
    np.testing.assert_allclose(directions(resized), directions(joints), atol=1e-9)


def test_bones_change_by_their_factors_in_every_frame(joints, rng):
    factors = draw_factors(joints, rng, BodyRange(unchanged=0))
    ratio = bone_lengths(resize(joints, factors)) / bone_lengths(joints)
    np.testing.assert_allclose(ratio, np.broadcast_to(factors[:, None, BONES[:, 1]], ratio.shape))
    assert ratio.std(axis=0).min() > 0.03


def test_left_and_right_limbs_stay_alike(joints, rng):
    factors = draw_factors(joints, rng)
    np.testing.assert_array_equal(factors, factors[:, H36M17.mirror])


def test_unchanged_bodies_are_exactly_that(joints, rng):
    np.testing.assert_allclose(vary(joints, rng, BodyRange(unchanged=1, mirrored=0)), joints, atol=1e-12)


def test_longer_legs_keep_the_feet_on_the_floor():
    standing = np.zeros((1, 2, 17, 3))
    for name, height in (("hip", 0.9), ("knee", 0.45), ("ankle", 0.0)):
        for side, x in (("l", 0.1), ("r", -0.1)):
            standing[..., H36M17.index(f"{side}_{name}"), :] = [x, 0, height]
    standing[..., H36M17.index("pelvis"), :] = [0, 0, 0.9]
    for i, name in enumerate(("spine", "thorax", "nose", "head", "l_shoulder", "r_shoulder")):
        standing[..., H36M17.index(name), :] = [0, 0, 1.1 + 0.1 * i]
    factors = np.ones((1, 17))
    factors[:, H36M17.indices(("l_knee", "r_knee", "l_ankle", "r_ankle"))] = 1.2
    resized = resize(standing, factors)
    np.testing.assert_allclose(resized[..., H36M17.indices(("l_ankle", "r_ankle")), 2], 0, atol=1e-9)
    np.testing.assert_allclose(resized[..., H36M17.index("pelvis"), 2], 1.08)


def test_mirror_twice_is_nothing_and_keeps_sizes(joints):
    np.testing.assert_allclose(mirror(mirror(joints)), joints)
    np.testing.assert_allclose(size_m(mirror(joints)), size_m(joints))
    left = H36M17.index("l_wrist")
    np.testing.assert_allclose(
        mirror(joints)[..., left, :], joints[..., H36M17.index("r_wrist"), :] * [-1, 1, 1]
    )


def test_widths_lie_in_their_range(joints, rng):
    many = np.repeat(joints, 50, axis=0)
    out = resize(many, draw_factors(many, rng, BodyRange(unchanged=0, shoulders=(0.06, 0.1))))
    left, right = H36M17.indices(("l_shoulder", "r_shoulder"))
    width = np.linalg.norm(out[..., left, :] - out[..., right, :], axis=-1).mean(axis=-1) / size_m(many)
    # both shoulder bones scale alike, so the distance between the shoulders scales exactly
    assert 0.06 <= width.min() < 0.065
    assert 0.095 < width.max() <= 0.1
