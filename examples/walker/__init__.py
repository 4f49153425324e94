"""The synthetic walker: motion, cameras, and the files that a user would have of it."""

from .camera import camera_poses, side_camera
from .walk import walker

__all__ = ["camera_poses", "side_camera", "walker"]
