"""The rectifier alone, inside somebody else's loop: frames arrive in chunks and leave in the body's own axes.

python inside_your_pipeline.py
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pcnet3d.examples.walker import camera_poses, side_camera, walker
from pcnet3d.models import load_rectifier
from pcnet3d.pipeline import H36M17, rotate, transpose

CHUNK = 64  # frames at a time


def your_lifter() -> Iterator[np.ndarray]:
    """Your lifter stands here: chunks (t, 17, 3), Human3.6M order, x right, y down, z away, any scale."""
    walk = walker()
    joints = camera_poses(walk, side_camera(walk)).joints
    for start in range(0, len(joints), CHUNK):
        yield joints[start : start + CHUNK]


def main() -> None:
    rectifier = load_rectifier("geometric")
    print(f"rectifier: {rectifier.method}")
    for chunk in your_lifter():
        joints = chunk - chunk[:, [H36M17.index("pelvis")]]
        R_camera_from_body, error_deg = rectifier.rotation(joints)
        body = rotate(transpose(R_camera_from_body), joints)  # x back, y right, z up
        reach = -body[:, H36M17.index("r_wrist"), 0]
        stated = f"{np.nanmean(error_deg):.1f}" if np.isfinite(error_deg).any() else "no"
        print(
            f"{len(body)} frames: right wrist {reach.min():+.2f} to {reach.max():+.2f} m in front of the pelvis, "
            f"{stated} expected error in degrees"
        )


if __name__ == "__main__":
    main()
