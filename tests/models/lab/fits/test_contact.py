"""What contacts are learned from: takes as captured and as lifted, with what is on the floor carried along."""

import numpy as np

from golden.virtual import walked
from pcnet3d.models.gait.contact import shipped_net
from pcnet3d.models.gait.gait import ON_FLOOR
from pcnet3d.models.lab.fits.contact import examples, floor_speed
from pcnet3d.pipeline.core.layouts import H36M17


def test_examples_are_of_both_feet_lifted_and_captured():
    clip = walked("01_walk", seconds=8)
    features, contact, weight = examples([clip], 0, "typical")
    frames = len(clip)
    assert len(features) == len(contact) == len(weight) == 4 * frames  # 2 feet, lifted and captured
    assert set(np.unique(contact)) == {0.0, 1.0}
    assert np.mean((shipped_net().probability(features) > ON_FLOOR) == contact) > 0.75


def test_speed_over_the_floor():
    joints = np.zeros((90, len(H36M17), 3))
    joints[..., 0] = np.linspace(0, 9, 90)[:, None]
    joints[..., 2] = np.sin(np.arange(90))[:, None]  # up and down is not over the floor
    np.testing.assert_allclose(floor_speed(joints, 30.0), 9 / 89 * 30)
