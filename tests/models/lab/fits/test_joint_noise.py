"""How joints err together, fitted to the lifter in place."""

from types import SimpleNamespace

import numpy as np

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import JOINTS
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.models.lab.fits import joint_noise
from pcnet3d.models.rectifier.load import load_rectifier
from pcnet3d.pipeline.core.rotations import rotate

R_CAMERA_FROM_WORLD = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # a level camera that looks north


def test_the_errors_name_the_lifter_that_is_in_place(monkeypatch):
    """They kept the name of the lifter before, and every later step of a refit took the new one for a stranger."""
    truth = rotate(R_CAMERA_FROM_WORLD, walker().world)
    rng = np.random.default_rng(0)
    lifted = truth + rng.normal(0, 0.02, truth.shape)
    whole = np.ones(len(truth), dtype=bool)
    spread = rng.uniform(0.01, 0.03, len(truth))
    pair = joint_noise.Pair(lifted, lifted, truth, R_world_from_body(truth), whole, spread)
    monkeypatch.setattr(joint_noise, "read_pairs", lambda paths: [pair])
    monkeypatch.setattr(joint_noise, "load_lifter", lambda: SimpleNamespace(method="pcnet3d@another"))
    noise = joint_noise.fit([], [], load_rectifier("geometric"))
    assert noise.lifter == "pcnet3d@another"
    assert noise.modes.shape[1:] == (len(JOINTS), 3)
