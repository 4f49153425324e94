"""Virtual pinhole cameras around motion capture, for many windows or one whole take at a time.

Camera axes are CAMERA's: x right, y down, z away. Yaw is the heading of the view about the vertical, pitch is
positive when the camera looks DOWN, roll is positive when the image's content turns counter-clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Generic

import numpy as np

from ....pipeline.core.camera import view_rotation
from ....pipeline.core.layouts import H36M17
from ...common.vectors import Array, library_of, rotate, transpose

IMAGE_SIZES = ((1920, 1080), (1280, 720), (1080, 1920), (1440, 1080), (1000, 1000))


@dataclass(frozen=True)
class ViewRange:
    """What views are drawn from: angles uniformly, focal length and distance log-uniformly.

    yaw_deg, pitch_deg, roll_deg: ranges, the convention above. focal: focal length over the longer image side (phones
    filming: 0.65-0.85; a 35 to 70 mm lens on full frame: 1 to 2). distance: over the smallest one at which
    everything is in the image. distance_m: in its place, metres along the viewing axis to the middle of the points,
    but never nearer than that smallest one. margin: share of the half image that stays empty at its border.
    pans: share of views whose camera slowly follows the person.
    """

    yaw_deg: tuple[float, float] = (0.0, 360.0)
    pitch_deg: tuple[float, float] = (-30.0, 45.0)
    roll_deg: tuple[float, float] = (-10.0, 10.0)
    focal: tuple[float, float] = (0.65, 2.0)
    distance: tuple[float, float] = (1.05, 2.5)
    distance_m: tuple[float, float] | None = None
    nearest_m: float = 1.0
    margin: float = 0.04
    pans: float = 0.0


# Anything a video may come from: steep and tilted views, long lenses.
WILD = ViewRange()
# Cameras as people use them: a phone or a camera at chest height or above on a levelled tripod, across a room.
TYPICAL = ViewRange(pitch_deg=(-5.0, 25.0), roll_deg=(-5.0, 5.0), focal=(0.67, 0.95), distance_m=(2.0, 6.0))


@dataclass(frozen=True, eq=False)
class Cameras(Generic[Array]):
    """Pinhole cameras of leading shape (...,), without lens distortion, principal point in the image's centre, of
    numpy or torch.

    R_camera_from_world: (..., 1, 3, 3), or (..., T, 3, 3) for one that pans. position: (..., 3) metres, world.
    focal_px: (...,). image_size: (..., 2) width and height in pixels.
    """

    R_camera_from_world: Array
    position: Array
    focal_px: Array
    image_size: Array

    @property
    def up(self) -> Array:
        """(..., 1 or T, 3) the direction against gravity, in the camera."""
        return self.R_camera_from_world[..., :, 2]

    def to_camera(self, joints_world: Array) -> Array:
        """(..., T, J, 3) world -> camera, metres, origin at the camera."""
        return rotate(self.R_camera_from_world, joints_world - self.position[..., None, None, :])

    def project(self, joints_camera: Array) -> Array:
        """(..., T, J, 3) camera -> (..., T, J, 2) pixels."""
        rays = joints_camera[..., :2] / joints_camera[..., 2:]
        return rays * self.focal_px[..., None, None, None] + self.image_size[..., None, None, :] / 2

    def panned(self, angle: Array) -> Cameras[Array]:
        """Turned about their own vertical axes by angles (..., T), radians."""
        library: Any = library_of(angle)
        c, s, zero, one = library.cos(angle), library.sin(angle), 0 * angle, 0 * angle + 1
        turn = library.stack([c, zero, -s, zero, one, zero, s, zero, c], -1).reshape(*angle.shape, 3, 3)
        return replace(self, R_camera_from_world=turn @ self.R_camera_from_world)


def place(
    joints_world: np.ndarray, rng: np.random.Generator, views: ViewRange | None = None
) -> Cameras[np.ndarray]:
    """One camera a window, somewhere from which every joint of every frame is inside the image.

    joints_world: (..., T, J, 3) metres, +Z up. The distance and then the sideways shift are drawn from the
    exact intervals that keep everything inside, so the person may be anywhere in the image.
    """
    views = views or ViewRange()
    lead = joints_world.shape[:-3]
    size = np.array(IMAGE_SIZES, dtype=float)[rng.integers(len(IMAGE_SIZES), size=lead)]
    focal_px = _log_uniform(rng, views.focal, lead) * size.max(axis=-1)
    R = view_rotation(
        rng.uniform(*views.yaw_deg, lead),
        rng.uniform(*views.pitch_deg, lead),
        rng.uniform(*views.roll_deg, lead),
    )
    points = joints_world.reshape(*lead, -1, 3).astype(np.float64)
    centre = (points.min(axis=-2) + points.max(axis=-2)) / 2
    q = rotate(R, points - centre[..., None, :])
    depth = q[..., 2]
    half = size / 2 / focal_px[..., None] * (1 - views.margin)  # tangent of the half view, (..., 2)
    needed = np.abs(q[..., :2]) / half[..., None, :] - depth[..., None]
    least = np.maximum(needed.max(axis=(-2, -1)), views.nearest_m - depth.min(axis=-1))
    if views.distance_m is None:
        distance = least * _log_uniform(rng, views.distance, lead)
    else:
        distance = np.maximum(least, _log_uniform(rng, views.distance_m, lead))
    room = (distance[..., None] + depth)[..., None] * half[..., None, :]
    low, high = (-room - q[..., :2]).max(axis=-2), (room - q[..., :2]).min(axis=-2)
    shift = low + rng.uniform(0, 1, (*lead, 2)) * (high - low)
    offset = np.concatenate([shift, distance[..., None]], axis=-1)
    position = centre - rotate(transpose(R), offset[..., None, :])[..., 0, :]
    cameras = Cameras(R[..., None, :, :], position, focal_px, size)
    return _panned(cameras, joints_world, rng, views.pans) if views.pans else cameras


def _panned(
    cameras: Cameras[np.ndarray], joints_world: np.ndarray, rng: np.random.Generator, share: float
) -> Cameras[np.ndarray]:
    """Some of the cameras turn about their own vertical axis and bring the person slowly towards the middle."""
    from scipy.ndimage import uniform_filter1d

    pelvis = cameras.to_camera(joints_world)[..., H36M17.index("pelvis"), :]
    frames = pelvis.shape[-2]
    bearing = uniform_filter1d(
        np.arctan2(pelvis[..., 0], pelvis[..., 2]), min(61, frames), axis=-1, mode="nearest"
    )
    lead = bearing.shape[:-1]
    gain = rng.uniform(0.3, 1.0, lead) * (rng.uniform(size=lead) < share)
    angle = gain[..., None] * bearing
    return cameras.panned(angle)


def _log_uniform(
    rng: np.random.Generator, between: tuple[float, float], shape: tuple[int, ...]
) -> np.ndarray:
    low, high = between
    return low * (high / low) ** rng.uniform(0, 1, shape)
