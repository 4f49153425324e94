"""Errors with known answers."""

import numpy as np
from scipy.spatial.transform import Rotation

from pcnet3d.models.common.metrics import joint_error, relative
from pcnet3d.models.lab.cases import procrustes_error, scaled
from pcnet3d.pipeline import rotate


def test_scale_rotation_and_shift_are_taken_out_but_no_mirror_and_missing_frames_stay_missing():
    truth = relative(np.random.default_rng(0).normal(size=(7, 17, 3)))
    factors = np.linspace(0.5, 2, 7)[:, None, None]
    np.testing.assert_allclose(joint_error(scaled(truth * factors, truth), truth), 0, atol=1e-12)
    np.testing.assert_allclose(joint_error(scaled(truth * 3, truth, "take"), truth), 0, atol=1e-12)
    assert joint_error(scaled(truth * factors, truth, "take"), truth).max() > 0.1
    R = Rotation.from_rotvec([0.3, 2.0, -0.5]).as_matrix()
    np.testing.assert_allclose(procrustes_error(rotate(R, truth) * 1.7 + 0.4, truth), 0, atol=1e-9)
    assert procrustes_error(truth * [-1, 1, 1], truth).min() > 0.1
    lifted = truth.copy()
    lifted[2] = np.nan
    for error in (joint_error(scaled(lifted, truth), truth), procrustes_error(lifted, truth)):
        np.testing.assert_array_equal(np.isnan(error), np.arange(7) == 2)
    assert np.isfinite(joint_error(scaled(lifted, truth, "take"), truth)[[0, 1, 3]]).all()
