"""What a run may know of a take before it places the pelvis: the camera's focal length and the body's size."""

from __future__ import annotations

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera
from ....pipeline.core.frames import scaled_covariance
from ....pipeline.core.pose import PoseSequence
from .testbed import SeenTake

KNOWN, ASSUMED = "focal known", "focal assumed"


def camera_of(seen: SeenTake, case: str) -> Camera:
    """The take's camera as it is known: by its focal length, or, ASSUMED, by what is usual."""
    width, height = seen.image_size
    focal_px, spread = seen.focal_px, 0.0
    if case == ASSUMED:
        focal_px, spread = PRIOR_FOCAL * max(width, height), PRIOR_FOCAL_SPREAD
    return Camera((width, height), focal_px, focal_px * spread, "told")


def by_stature(lifted: PoseSequence, truth: np.ndarray) -> PoseSequence:
    """The poses in metres as `--stature` would bring them there, by the stature of the truth (T, 17, 3)."""
    factor = implied_stature(truth) / implied_stature(lifted.joints)
    covariance = scaled_covariance(lifted.covariance, factor)
    return lifted.with_(joints=lifted.joints * factor, covariance=covariance)
