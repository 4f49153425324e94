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

    centre_px: (T, 2) pixels where the ray goes. image_size: (2,). The options are for the history: `bearing_deg` is
    the least and the greatest angle to the right at which the person stands, by which the heading is off when
    nothing is turned; an unknown focal length is taken for the longer side of the image there.
    """
    focal = ASSUMED_FOCAL * float(image_size.max()) if focal_px is None else focal_px
    rays = (centre_px - image_size / 2) / focal
    bearing = np.degrees(np.arctan(rays[:, 0]))
    if focal_px is not None:
        joints = rotate(ray_rotation(rays), joints)
    return joints, {
        "focal_px": round(focal, 1),
        "focal_known": focal_px is not None,
        "bearing_deg": [round(float(edge), 1) for edge in (bearing.min(), bearing.max())],
        "turned_by_the_ray": focal_px is not None,
    }
