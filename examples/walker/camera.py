"""A pinhole camera that stands still, turned and tilted, and the walker as it sees them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...models.common.canonical import R_world_from_body
from ...pipeline.core.conversions import change_frame
from ...pipeline.core.frames import CAMERA
from ...pipeline.core.pose import MadeBy, PoseSequence
from ...pipeline.core.rotations import rotate
from .skeleton import UP
from .walk import Walk


@dataclass(frozen=True, eq=False)
class Camera:
    """R_camera_from_world (3, 3): from a Z-up world to CAMERA axes (x right, y down, z away).
    position: (3,) metres in the world. focal_px: focal length; the principal point is the middle of the image."""

    R_camera_from_world: np.ndarray
    position: np.ndarray
    focal_px: float = 640.0
    width: int = 640
    height: int = 360

    def points(self, world: np.ndarray) -> np.ndarray:
        """(T, N, 3) world points in CAMERA axes, metres from the camera."""
        return rotate(self.R_camera_from_world, world - self.position)

    def project(self, world: np.ndarray) -> np.ndarray:
        """(T, N, 2) pixels of world points (T, N, 3) in front of the camera; x right, y down."""
        points = self.points(world)
        middle = np.array([self.width, self.height]) / 2
        return self.focal_px * points[..., :2] / points[..., 2:] + middle

    @property
    def up(self) -> np.ndarray:
        """(3,) against gravity, in CAMERA axes."""
        return self.R_camera_from_world[:, 2]


def aimed(
    target: np.ndarray, distance_m: float, heading_deg: float, pitch_deg: float, roll_deg: float
) -> Camera:
    """A camera that has `target` (3,), metres in a Z-up world, in the middle of its image.

    heading_deg: where it looks, 0 along +x, positive towards +y. pitch_deg: how far it looks down. roll_deg: turned
    about the line of sight, clockwise as seen from behind it.
    """
    heading, pitch, roll = np.radians([heading_deg, pitch_deg, roll_deg])
    ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
    away = np.cos(pitch) * ahead - np.sin(pitch) * UP
    level_right = np.cross(ahead, UP)
    level_down = np.cross(away, level_right)
    right = np.cos(roll) * level_right + np.sin(roll) * level_down
    return Camera(np.stack([right, np.cross(away, right), away]), target - distance_m * away)


def side_camera(walk: Walk) -> Camera:
    """The example's camera, fixed and tilted: the person comes in from the left, seen from the side, and at the end
    stands turned towards the camera by a third of a right angle; it looks down from above their head."""
    target = walk.root[-1] + 0.4 * (walk.root[0] - walk.root[-1]) + 0.1 * UP
    return aimed(target, 5.8, heading_deg=walk.heading_deg[-1] + 122, pitch_deg=15, roll_deg=5)


def camera_poses(walk: Walk, camera: Camera) -> PoseSequence:
    """The true skeleton in CAMERA, metres, relative to the pelvis, whose place is left out, as a lifter leaves it."""
    seen = change_frame(walk.poses, CAMERA, camera.R_camera_from_world)
    return seen.with_(path=None, made_by=MadeBy("estimated", "the example itself"))


def R_camera_from_body(walk: Walk, camera: Camera) -> np.ndarray:
    """(T, 3, 3), the truth that every rectifier is measured against (design.md section 4)."""
    return camera.R_camera_from_world @ R_world_from_body(walk.world)
