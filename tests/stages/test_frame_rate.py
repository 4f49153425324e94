"""What the paths of hands and feet say of the frame rate."""

import numpy as np

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, Take
from pcnet3d.pipeline.core.notices import notice
from pcnet3d.stages import rectify
from pcnet3d.stages.trajectories import Trajectories


def codes(take: Take) -> list[str]:
    return [each.code for each in take.notices]


def test_slow_motion_is_told(facing_camera):
    """A hand that takes half a minute from the hip to overhead."""
    assert "moves-slowly" in codes(Trajectories()(raising(facing_camera, np.linspace(0, 1, 400), 12.5)))


def test_poses_that_leap_do_not_say_that_the_frame_rate_is_wrong(facing_camera):
    """Of mirrored frames hands were said to be faster than people's, "if the rate is wrong"."""
    take = raising(facing_camera, 2 * np.sin(np.arange(400) / 5), 100)
    assert "moves-fast" in codes(Trajectories()(take))
    leaps = (notice("leaps", count=3, first=1),)
    assert "moves-fast" not in codes(Trajectories()(take.with_(findings=leaps)))


def raising(body, by_m, fps):
    """A take of a body whose right wrist is so much higher than it was, (400,) metres."""
    joints = np.tile(body, (400, 1, 1))
    joints[:, H36M17.index("r_wrist"), 1] -= by_m
    poses = PoseSequence(joints, H36M17, CAMERA.with_(origin="pelvis"), time_s=np.arange(400) / fps)
    return Take("t", poses=poses, rectified=rectify(poses))
