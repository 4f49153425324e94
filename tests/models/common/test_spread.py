"""The one number of a lifter's stated error."""

import warnings

import numpy as np
import pytest

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.common.spread import stated_spread
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence
from pcnet3d.pipeline.core.anthropometry import implied_stature


def test_it_is_the_geometric_mean_of_the_deviations_in_statures():
    joints = walker().world[:10].astype(np.float32)
    covariance = np.zeros((10, 17, 3, 3))
    covariance[:] = np.diag([0.01, 0.01, 0.08]) ** 2
    covariance[:, H36M17.index("pelvis")] = 0
    covariance[3, 5] = np.nan
    poses = PoseSequence(joints, H36M17, CAMERA, covariance=covariance)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = stated_spread(poses)
    assert found[0] == pytest.approx(0.02 / implied_stature(joints), rel=1e-4)
    assert np.isnan(found[3])
    assert np.isnan(stated_spread(poses.with_(covariance=None))).all()
