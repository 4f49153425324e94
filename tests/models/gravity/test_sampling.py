"""A rectifier that is asked about some frames of a take, and the frames between."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.models.gravity.votes import take_rotation
from pcnet3d.pipeline.core.layouts import H36M17
from pcnet3d.pipeline.core.rotations import geodesic_deg, is_finite, rotate

LONG, FPS = 3000, 30.0
CAMERA_FROM_WORLD = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
TORSO = {
    "l_hip": (0, -0.1, 0),
    "r_hip": (0, 0.1, 0),
    "l_shoulder": (0, -0.2, 0.5),
    "r_shoulder": (0, 0.2, 0.5),
}


class Knowing:
    """A rectifier that knows the rotation of every body by its frame's number, which the head carries, and counts."""

    method = "knowing"

    def __init__(self, R_camera_from_body: np.ndarray) -> None:
        self.R, self.asked = R_camera_from_body, np.zeros(len(R_camera_from_body), dtype=int)

    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = joints[:, H36M17.index("head"), 0].astype(int)
        np.add.at(self.asked, rows, 1)
        return self.R[rows], np.full(len(rows), 5.0)


def turning(frames: int, deg_per_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints (T, 17, 3) of a body that turns in front of a level camera, their times, and R_camera_from_body."""
    time_s = np.arange(frames) / FPS
    R_world_from_own = Rotation.from_euler("z", deg_per_s * time_s[:, None], degrees=True).as_matrix()
    body = np.zeros((17, 3))
    for name, place in TORSO.items():
        body[H36M17.index(name)] = place
    world = rotate(R_world_from_own, np.broadcast_to(body, (frames, 17, 3)))
    R = CAMERA_FROM_WORLD @ R_world_from_body(world)
    joints = rotate(CAMERA_FROM_WORLD, world)
    joints[:, H36M17.index("head"), 0] = np.arange(frames)
    return joints, time_s, R


@pytest.mark.parametrize("frames", [1, 2, 1199])
def test_a_short_take_is_asked_about_every_frame_once(frames: int) -> None:
    joints, time_s, R = turning(frames, 20.0)
    rectifier = Knowing(R)
    found, error_deg = take_rotation(rectifier, joints, time_s)
    assert (rectifier.asked == 1).all()
    assert np.array_equal(found, R)
    assert len(error_deg) == frames


def test_frames_between_follow_a_turn_that_the_joints_show() -> None:
    joints, time_s, R = turning(LONG, 170.0)  # 51 degrees between frames that are asked about
    rectifier = Knowing(R)
    found, error_deg = take_rotation(rectifier, joints, time_s)
    assert LONG / 6 <= rectifier.asked.sum() <= LONG / 4
    assert np.max(geodesic_deg(found, R)) < 1e-4
    assert np.allclose(error_deg, 5.0)


def test_what_the_rectifier_knows_better_of_the_heading_is_kept() -> None:
    joints, time_s, R = turning(LONG, 40.0)
    better = R @ Rotation.from_euler("z", 20, degrees=True).as_matrix()
    found, _ = take_rotation(Knowing(better), joints, time_s)
    assert np.max(geodesic_deg(found, better)) < 1e-4


def test_a_frame_without_a_shoulder_is_asked_about() -> None:
    joints, time_s, R = turning(LONG, 20.0)
    joints[1001:1004, H36M17.index("l_shoulder")] = np.nan
    rectifier = Knowing(R)
    found, _ = take_rotation(rectifier, joints, time_s)
    assert (rectifier.asked[1001:1004] == 1).all()
    assert is_finite(found).all()


def test_nothing_is_taken_across_a_clip_boundary() -> None:
    joints, time_s, R = turning(LONG, 0.0)
    seam = 1502
    other = CAMERA_FROM_WORLD @ np.diag([-1.0, -1.0, 1.0]) @ CAMERA_FROM_WORLD.T @ R
    R = np.where((np.arange(LONG) < seam)[:, None, None], R, other)  # the joints do not show it
    found, _ = take_rotation(Knowing(R), joints, time_s, (seam,))
    assert np.max(geodesic_deg(found, R)) < 1e-4


def test_where_nobody_near_has_a_rotation_every_frame_is_asked_about() -> None:
    joints, time_s, R = turning(LONG, 20.0)
    R[:1000] = np.nan
    rectifier = Knowing(R)
    found, _ = take_rotation(rectifier, joints, time_s, (1000,))
    assert (rectifier.asked[:1000] == 1).all()
    assert not is_finite(found[:1000]).any()
    assert is_finite(found[1000:]).all()
