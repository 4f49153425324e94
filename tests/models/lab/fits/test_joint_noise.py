"""How joints err together, fitted to the lifter in place."""

from types import SimpleNamespace

import numpy as np

from golden.virtual import exact, walked
from pcnet3d.models.angle_error.joint_noise import JOINTS
from pcnet3d.models.lab.evaluation.testbed import LiftedTake
from pcnet3d.models.lab.fits import joint_noise
from pcnet3d.models.rectifier.load import load_rectifier


def test_the_errors_name_the_lifter_that_is_in_place(monkeypatch):
    """They kept the name of the lifter before, and every later step of a refit took the new one for a stranger."""
    take = exact(walked(seconds=4))
    rng = np.random.default_rng(0)
    joints = take.lifted.joints + rng.normal(0, 0.02, take.lifted.joints.shape)
    covariance = np.tile(rng.uniform(0.01, 0.03, (len(joints), 1, 1, 1)) ** 2 * np.eye(3), (1, 17, 1, 1))
    lifted = LiftedTake(take.lifted.with_(joints=joints, covariance=covariance), take.seen)
    monkeypatch.setattr(joint_noise, "load_lifter", lambda: SimpleNamespace(method="pcnet3d@another"))
    noise = joint_noise.fit([lifted], [lifted], load_rectifier("geometric"))
    assert noise.lifter == "pcnet3d@another"
    assert noise.modes.shape[1:] == (len(JOINTS), 3)
    assert np.isfinite(noise.powers).all()
