"""A camera that runs: one frame at a time goes in, joints upright by the up of all frames so far come out.

python live.py
"""

from __future__ import annotations

from pcnet3d.examples.walker import camera_poses, side_camera, walker
from pcnet3d.models import LiveRectifier
from pcnet3d.pipeline import H36M17, rotate, transpose


def main() -> None:
    walk = walker()
    frames = camera_poses(walk, side_camera(walk)).joints  # your lifter, a frame (17, 3) at a time
    live = LiveRectifier()
    for number, (joints, time_s) in enumerate(zip(frames, walk.time_s, strict=True)):
        frame = live.update(joints, time_s)
        body = rotate(transpose(frame.R_camera_from_body), joints)  # x back, y right, z up
        if number % 30 == 0:
            print(
                f"{time_s:.0f} s: up known to {frame.up_error_deg:.1f} degrees, "
                f"right wrist {body[H36M17.index('r_wrist'), 2]:+.2f} m above the pelvis"
            )


if __name__ == "__main__":
    main()
