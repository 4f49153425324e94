"""The person whom every golden file shows: upright, knees bent, turning on the spot or walking off."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pcnet3d.pipeline import H36M17, rotate


def facing_camera() -> np.ndarray:
    """(17, 3) metres, H36M17 in CAMERA, pelvis at the origin: an upright person who faces the camera.

    Right-handed and anatomical: the right hip at smaller x, knees and nose towards the camera (-z).
    """
    joints = {
        "pelvis": (0.0, 0.0, 0.0),
        "r_hip": (-0.10, 0.01, 0.0),
        "r_knee": (-0.11, 0.44, -0.06),
        "r_ankle": (-0.11, 0.87, 0.02),
        "spine": (0.0, -0.24, 0.01),
        "thorax": (0.0, -0.49, 0.0),
        "nose": (0.0, -0.60, -0.09),
        "head": (0.0, -0.75, -0.01),
        "r_shoulder": (-0.18, -0.46, 0.0),
        "r_elbow": (-0.22, -0.18, 0.03),
        "r_wrist": (-0.21, 0.05, -0.05),
    }
    joints |= {
        name.replace("r_", "l_"): (-x, y, z) for name, (x, y, z) in joints.items() if name.startswith("r_")
    }
    return np.array([joints[name] for name in H36M17.joints])


@dataclass(frozen=True)
class Person:
    """Whose bodies a golden file gets: those of `turning` and `standing`, or of the mirrored person."""

    mirrored: bool = False

    def turning(self, count: int) -> np.ndarray:
        return turning(count) * [-1.0 if self.mirrored else 1.0, 1, 1]

    def standing(self, count: int) -> np.ndarray:
        return standing(count) * [-1.0 if self.mirrored else 1.0, 1, 1]


def turning(count: int) -> np.ndarray:
    """(T, 17, 3): the person of `facing_camera` turning on the spot, every frame different."""
    angle_deg = 0.3 * np.arange(count)
    about_vertical = Rotation.from_rotvec(angle_deg[:, None] * [0, 1, 0], degrees=True).as_matrix()
    return rotate(about_vertical, facing_camera()[None])


def standing(count: int) -> np.ndarray:
    """(T, 17, 3) metres, z up: the same person in a world, bobbing and walking off while turning."""
    x, y, z = np.moveaxis(turning(count), -1, 0)
    walked = np.linspace(0, 1, count)[:, None]
    return np.stack([x + walked, z - 0.5 * walked, 0.9 + 0.03 * np.sin(9 * walked) - y], axis=-1)
