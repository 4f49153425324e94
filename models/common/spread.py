"""How sure a lifter says it is of a frame, in one number."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.blocks import blocks
from ...pipeline.core.pose import PoseSequence


def stated_spread(poses: PoseSequence) -> np.ndarray:
    """(T,) geometric mean of the joints' stated standard deviations over axes and joints, as a share of stature; NaN
    where nobody states them. poses: H36M17; the pelvis, from which the others are counted, is left out."""
    poses = poses.without_feet
    if poses.covariance is None:
        return np.full(len(poses), np.nan)
    others = [joint != "pelvis" for joint in poses.layout.joints]
    log_volume = np.zeros(len(poses))
    for rows in blocks(len(poses)):  # in double precision a long take's covariances are a gigabyte
        with np.errstate(invalid="ignore"):  # of missing joints
            log_volume[rows] = np.linalg.slogdet(poses.covariance[rows, others].astype(np.float64))[1].mean(
                axis=1
            )
    return np.exp(log_volume / 6) / implied_stature(poses.joints)
