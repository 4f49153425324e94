"""From an array of joints in camera axes to numbers that do not depend on the camera, as in a notebook.

python from_arrays.py
"""

from __future__ import annotations

import numpy as np

from pcnet3d.examples.walker import camera_poses, side_camera, walker
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, angle_deg
from pcnet3d.stages import rectify


def main() -> None:
    # Your lifter's output stands here: (T, 17, 3) in Human3.6M order, x right, y down, z away from the camera.
    walk = walker()
    joints = camera_poses(walk, side_camera(walk)).joints
    time_s = np.arange(len(joints)) / 30

    poses = PoseSequence(joints, H36M17, CAMERA, time_s=time_s)
    rectified = rectify(poses, rectifier="geometric")

    level, body = rectified.level, rectified.body
    wrist = level.joint("r_wrist") - level.joint("r_shoulder")
    thigh = body.joint("r_knee") - body.joint("r_hip")
    shank = body.joint("r_ankle") - body.joint("r_knee")
    knee_deg = angle_deg(thigh, shank)

    print(f"{len(poses)} frames at {poses.fps:g} per second, in {body.frame}")
    print(f"right wrist, highest above the shoulder: {wrist[:, 2].max():.2f} m")
    print(f"right knee flexion: {knee_deg.min():.0f} to {knee_deg.max():.0f} degrees")
    print("done to the data:", ", ".join(step.name for step in body.history))


if __name__ == "__main__":
    main()
