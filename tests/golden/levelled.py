"""The walker before cameras that pitch, roll and turn, as a rectifier sees it, and headings alone."""

import numpy as np
from scipy.spatial.transform import Rotation

from pcnet3d.examples.walker.walk import walker
from pcnet3d.models import load_rectifier
from pcnet3d.models.common.canonical import R_world_from_body
from pcnet3d.models.gravity.levelling import level_moving, level_static, upright
from pcnet3d.models.gravity.votes import PersonFrames
from pcnet3d.pipeline import rotate
from pcnet3d.pipeline.core.camera import view_rotation
from pcnet3d.pipeline.core.rotations import from_columns, unit

Z = np.array([0.0, 0.0, 1.0])


def headed(heading_deg) -> np.ndarray:
    """(T, 3, 3) of a person who stands upright about +z."""
    return Rotation.from_rotvec(np.outer(np.radians(heading_deg), Z)).as_matrix()


def heading_deg(R) -> np.ndarray:
    return np.degrees(np.arctan2(R[:, 1, 0], R[:, 0, 0]))


def seen_of(R, error_deg, time_s, seams=()) -> PersonFrames:
    """Of a rectifier's answers alone, whatever the joints."""
    return PersonFrames(np.zeros((len(R), 17, 3)), R, error_deg, time_s, seams)


def smoothed(heading, time_s=None, error_deg=5.0, seams=()):
    R = headed(heading)
    time_s = np.arange(len(R)) / 30 if time_s is None else time_s
    errors = np.broadcast_to(float(error_deg), len(R)) if np.ndim(error_deg) == 0 else error_deg
    return upright(seen_of(R, errors, time_s, seams), np.broadcast_to(Z, (len(R), 3)))


def noise_about(R, scatter_deg, seed=0) -> np.ndarray:
    turn = np.random.default_rng(seed).normal(scale=np.radians(scatter_deg), size=(len(R), 3))
    return R @ Rotation.from_rotvec(turn).as_matrix()


class Filmed:
    """The walker before a camera whose yaw, pitch and roll are functions of time, relative to the pelvis."""

    def __init__(self, yaw=120.0, pitch=15.0, roll=5.0, **options):
        self.walk = walker(**options)
        time_s = self.walk.time_s
        angles = [np.broadcast_to(a(time_s) if callable(a) else a, time_s.shape) for a in (yaw, pitch, roll)]
        R_camera_from_world = view_rotation(*angles)
        self.time_s = time_s
        self.up = R_camera_from_world[:, :, 2]
        self.joints = rotate(R_camera_from_world, self.walk.world - self.walk.world[:, :1])
        self.R = R_camera_from_world @ R_world_from_body(self.walk.world)
        self.error_deg = np.full(len(time_s), 6.0)

    def static(self, R=None, others=()):
        return level_static(self.seen(R), others)

    def moving(self, R=None):
        return level_moving(self.seen(R))

    def seen(self, R=None, error_deg=None, joints=None) -> PersonFrames:
        """As a rectifier sees it that is right but for what is given."""
        given = (self.joints, joints), (self.R, R), (self.error_deg, error_deg)
        return PersonFrames(*(own if other is None else other for own, other in given), self.time_s)

    def by(self, name):
        """Turned by a rectifier: R and its expected error."""
        R, error_deg = load_rectifier(name).rotation(self.joints)
        return R, error_deg

    @property
    def R_level(self) -> np.ndarray:
        """(T, 3, 3) the truth of R_camera_from_level by a camera's heading."""
        back = unit(Z - (self.up @ Z)[:, None] * self.up)
        return from_columns(back, np.cross(self.up, back), self.up)
