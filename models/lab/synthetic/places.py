"""Where people are in the images of real videos, and how large: facts measured from keypoints that detectors found."""

from __future__ import annotations

from ....pipeline.core.layouts import LIMBS

TRUNK = [row for row, joint in enumerate(LIMBS) if joint.endswith(("hip", "shoulder"))]  # of LIMBS

# A row is a second of a video or less: x (right) and y (down) of the mean of hips and shoulders from the image's
# middle, the root mean square distance of LIMBS from there, all in longer image sides, and the image's width over its
# height.
PLACES = (
    # A boxer, 854 x 480, found by AlphaPose (MotionBERT's demo output at 638e8dd).
    (0.089, -0.067, 0.118, 1.78), (0.074, -0.071, 0.118, 1.78),
    (0.086, -0.065, 0.118, 1.78), (0.087, -0.069, 0.120, 1.78),
    # A figure skater whom the camera follows, 1280 x 720, HRNet (an MHFormer run, AutoDance at ef5d696).
    (0.025, -0.062, 0.147, 1.78), (-0.002, -0.074, 0.152, 1.78),
    (0.014, -0.060, 0.140, 1.78), (0.028, -0.065, 0.156, 1.78),
    # A man on a roof, standing and squatting, 1768 x 994, MoveNet (Sports2D's demo at 9c8a3d2).
    (-0.137, -0.165, 0.080, 1.78), (-0.139, -0.170, 0.081, 1.78),
    (-0.136, -0.162, 0.067, 1.78), (-0.086, -0.168, 0.051, 1.78),
    # A woman who walks across the same image, MoveNet; then across a piece of it, 884 x 300.
    (-0.305, 0.095, 0.077, 1.78), (-0.429, 0.095, 0.073, 1.78),
    (0.197, 0.123, 0.057, 1.78), (0.316, 0.095, 0.062, 1.78),
    (0.208, -0.016, 0.072, 2.95), (0.027, -0.020, 0.074, 2.95), (-0.161, -0.023, 0.077, 2.95),
    # A man who balances, four phones held upright, 1080 x 1920, OpenPose (Pose2Sim's demo).
    (-0.016, -0.157, 0.141, 0.56), (0.037, -0.130, 0.147, 0.56),
    (0.019, -0.154, 0.125, 0.56), (-0.003, -0.144, 0.138, 0.56),
    (0.004, -0.109, 0.133, 0.57), (-0.061, -0.129, 0.134, 0.57),
    (-0.093, -0.083, 0.154, 0.57), (-0.053, -0.129, 0.147, 0.57),
    # The same man standing still, MoveNet.
    (-0.006, -0.151, 0.162, 0.57), (-0.005, -0.153, 0.151, 0.57),
    (-0.032, -0.118, 0.147, 0.56), (-0.054, -0.110, 0.160, 0.56),
)  # fmt: skip
PLACE_SPREAD = 0.02  # standard deviations of what is drawn about a row: of x and y,
SIZE_SPREAD = 0.1  # and of the size's logarithm
