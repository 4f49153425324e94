"""Networks that see a person in a crop answer along the ray to the person, not along the camera's axis."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...pipeline.core.rotations import rotate
from .features import ASSUMED_FOCAL, ray_rotation


def from_ray(
    joints: np.ndarray, centre_px: np.ndarray, image_size: np.ndarray, focal_px: float | None
) -> tuple[np.ndarray, dict[str, Any]]:
    """Joints (T, J, 3) turned from the ray to the person to CAMERA where the focal length is known, else as they are.

    centre_px: (T, 2) pixels where the ray goes. image_size: (2,). The dict has fields of a
    pipeline.core.lifted.Lifted; an unknown focal length is taken for the longer side of the image there.
    """
    focal = ASSUMED_FOCAL * float(image_size.max()) if focal_px is None else focal_px
    rays = (centre_px - image_size / 2) / focal
    bearing = np.degrees(np.arctan(rays[:, 0]))
    if focal_px is not None:
        joints = rotate(ray_rotation(rays), joints)
    return joints, {"focal_px": focal, "bearing_deg": (float(bearing.min()), float(bearing.max()))}
