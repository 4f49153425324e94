"""How sure a lifter says it is of a frame, in one number."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.pose import PoseSequence


def stated_spread(poses: PoseSequence) -> np.ndarray:
    """(T,) geometric mean of the joints' stated standard deviations over axes and joints, as a share of stature; NaN
    where nobody states them. poses: H36M17; the pelvis, from which the others are counted, is left out."""
    if poses.covariance is None:
        return np.full(len(poses), np.nan)
    others = [joint != "pelvis" for joint in poses.layout.joints]
    with np.errstate(invalid="ignore"):  # of missing joints
        _, log_volume = np.linalg.slogdet(poses.covariance[:, others].astype(np.float64))
    return np.exp(log_volume.mean(axis=1) / 6) / implied_stature(poses.joints)
