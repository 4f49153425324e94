"""Virtual pinhole cameras around motion capture, one a window; and where people are in the images of real videos, and
how large, as detectors found them.

Camera axes are CAMERA's: x right, y down, z away. Yaw is the heading of the view about the vertical, pitch is
positive when the camera looks DOWN, roll is positive when the image's content turns counter-clockwise.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from pathlib import Path

import torch
from torch import Tensor

from ....pipeline.core.camera import view_rotation
from ....pipeline.core.layouts import H36M17, LIMBS
from ...common.vectors import dot, picked, rotate, transpose
from .draw import Draw

IMAGE_SIZES = ((1920, 1080), (1280, 720), (1080, 1920), (1440, 1080), (1000, 1000))
_AIM_FRAMES = 8  # of a window, about: so many tell its place and size
_AIMS = 4  # rounds; each leaves about a tenth of what was off
_PAN_FRAMES = 61  # over which a camera that pans averages where the person is

TRUNK = [row for row, joint in enumerate(LIMBS) if joint.endswith(("hip", "shoulder"))]  # of LIMBS

# (N, 4): where people are in the images of real videos, and how large; places.json says what a row is.
PLACES = [
    row
    for video in json.loads(Path(__file__).with_name("places.json").read_text(encoding="utf-8"))["videos"]
    for row in video["rows"]
]
PLACE_SPREAD = 0.02  # standard deviations of what is drawn about a row: of x and y,
SIZE_SPREAD = 0.1  # and of the size's logarithm


@dataclass(frozen=True)
class ViewRange:
    """What views are drawn from: angles uniformly, focal length and distance log-uniformly."""

    yaw_deg: tuple[float, float] = (0.0, 360.0)  # the convention above
    pitch_deg: tuple[float, float] = (-30.0, 45.0)
    roll_deg: tuple[float, float] = (-10.0, 10.0)
    # Over the longer image side: phones film with 0.65 to 0.85, a 35 to 70 mm lens on full frame has 1 to 2.
    focal: tuple[float, float] = (0.65, 2.0)
    distance: tuple[float, float] = (1.05, 2.5)  # over the smallest one at which everything is in the image
    # In its place: metres along the viewing axis to the middle of the points, but never nearer than that smallest one.
    distance_m: tuple[float, float] | None = None
    nearest_m: float = 1.0  # of any joint
    margin: float = 0.04  # share of the half image that stays empty at its border
    pans: float = 0.0  # share of views whose camera slowly follows the person


# Anything a video may come from: steep and tilted views, long lenses.
WILD = ViewRange()
# Cameras as people use them: a phone or a camera at chest height or above on a levelled tripod, across a room.
TYPICAL = ViewRange(pitch_deg=(-5.0, 25.0), roll_deg=(-5.0, 5.0), focal=(0.67, 0.95), distance_m=(2.0, 6.0))


@dataclass(frozen=True, eq=False)
class Cameras:
    """Pinhole cameras (B,), without lens distortion, principal point in the image's centre.

    R_camera_from_world: (B, 1, 3, 3), or (B, T, 3, 3) where one pans. position: (B, 3) metres, world.
    focal_px: (B,). image_size: (B, 2) width and height in pixels.
    """

    R_camera_from_world: Tensor
    position: Tensor
    focal_px: Tensor
    image_size: Tensor

    def to_camera(self, joints_world: Tensor) -> Tensor:
        """(B, T, J, 3) world -> camera, metres, origin at the camera."""
        return rotate(self.R_camera_from_world, joints_world - self.position[:, None, None])

    def project(self, joints_camera: Tensor) -> Tensor:
        """(B, T, J, 3) camera -> (B, T, J, 2) pixels."""
        rays = joints_camera[..., :2] / joints_camera[..., 2:]
        return rays * self.focal_px[:, None, None, None] + self.image_size[:, None, None] / 2


def place(joints_world: Tensor, draw: Draw, views: ViewRange = WILD, placed: float = 0.0) -> Cameras:
    """One camera a window, somewhere from which every joint of every frame is inside the image.

    joints_world: (B, T, 17, 3) metres, +Z up. The distance and then the sideways shift are drawn from the exact
    intervals that keep everything inside, so the person may be anywhere in the image. placed: share with the person
    where people are in real videos, and as large (PLACES), or as near to that as everything is inside; they do not
    pan.
    """
    count = len(joints_world)
    sizes = torch.tensor(IMAGE_SIZES, dtype=draw.dtype, device=draw.device)
    size = sizes[draw.integers(len(sizes), count)]
    there, spot = torch.zeros(count, dtype=torch.bool, device=draw.device), None
    if placed:
        there, spot = draw.share(placed, count), _spots(draw, count)
        tall = torch.stack([spot[:, 3], 1 / spot[:, 3]], dim=-1).clamp_max(1) * max(IMAGE_SIZES[0])
        size = torch.where(there[:, None], tall, size)
    focal = draw.log_uniform(views.focal, count)
    focal_px = focal * size.amax(-1)
    angles_deg = [draw.uniform(of, count) for of in (views.yaw_deg, views.pitch_deg, views.roll_deg)]
    R = torch.from_numpy(view_rotation(*(each.cpu().numpy() for each in angles_deg))).to(sizes)
    points = joints_world.flatten(1, 2)
    centre = (points.amin(1) + points.amax(1)) / 2
    q = rotate(R, points - centre[:, None])
    depth = q[..., 2]
    half = size / 2 / focal_px[:, None] * (1 - views.margin)  # tangent of the half view, (B, 2)
    needed = q[..., :2].abs() / half[:, None] - depth[..., None]
    least = torch.maximum(needed.amax(dim=(1, 2)), views.nearest_m - depth.amin(1))
    if views.distance_m is None:
        distance = least * draw.log_uniform(views.distance, count)
    else:
        distance = torch.maximum(least, draw.log_uniform(views.distance_m, count))
    aimed = None
    if spot is not None:
        near, aimed = _aimed(q, focal, spot, least)
        distance = torch.where(there, near, distance)
    room = (distance[:, None] + depth)[..., None] * half[:, None]
    low, high = (-room - q[..., :2]).amax(1), (room - q[..., :2]).amin(1)
    shift = low + draw.rand(count, 2) * (high - low)
    if aimed is not None:
        shift = torch.where(there[:, None], torch.minimum(torch.maximum(aimed, low), high), shift)
    offset = torch.cat([shift, distance[:, None]], dim=-1)
    position = centre - rotate(transpose(R), offset[:, None])[:, 0]
    cameras = Cameras(R[:, None], position, focal_px, size)
    return _panned(cameras, joints_world, draw, views.pans * ~there) if views.pans else cameras


def place_among(
    joints_world: Tensor, draw: Draw, usual: ViewRange, other: ViewRange, share: float, placed: float
) -> Cameras:
    """The same, a share of the windows before cameras of the one range, the rest of the other."""
    use = draw.share(share, len(joints_world))
    both = [place(joints_world, draw, views, placed) for views in (usual, other)]
    parts = ([getattr(cameras, field.name) for cameras in both] for field in fields(Cameras))
    return Cameras(*(torch.where(use[(..., *[None] * (a.ndim - 1))], a, b) for a, b in parts))


def place_and_size(points: Tensor) -> tuple[Tensor, Tensor]:
    """What a row of PLACES says, of joints LIMBS (B, T, 12, 2) from the image's middle in longer image sides:
    (B, 2) and (B,), means over the frames."""
    middle = picked(points, TRUNK).mean(-2)
    off = points - middle[..., None, :]
    return middle.mean(1), dot(off, off).mean(-1).sqrt().mean(-1)


def _spots(draw: Draw, count: int) -> Tensor:
    """(B, 4) rows of PLACES and what lies about them; as many to the left as to the right."""
    rows = torch.tensor(PLACES, dtype=draw.dtype, device=draw.device)[draw.integers(len(PLACES), count)]
    side = torch.where(draw.share(0.5, count), 1.0, -1.0)
    x, y = rows[:, :2].unbind(-1)
    place = torch.stack([side * x, y], dim=-1) + PLACE_SPREAD * draw.normal(count, 2, most=2)
    size = rows[:, 2] * (SIZE_SPREAD * draw.normal(count, most=2)).exp()
    return torch.cat([place, size[:, None], rows[:, 3:]], dim=-1)


def _aimed(q: Tensor, focal: Tensor, spot: Tensor, least: Tensor) -> tuple[Tensor, Tensor]:
    """Distance (B,), not below `least`, and shift (B, 2) across the view, metres, that show points q (B, T * 17, 3) of
    the camera's axes at place and size of spot (B, 4). focal: (B,) longer image sides."""
    q = q.unflatten(1, (-1, len(H36M17)))
    q = picked(q[:, :: max(1, q.shape[1] // _AIM_FRAMES)], H36M17.indices(LIMBS))
    aside, depth = focal[:, None, None, None] * q[..., :2], q[..., 2:]
    shift, distance = torch.zeros_like(spot[:, :2]), least
    for _ in range(_AIMS):
        shown = aside + (focal[:, None] * shift)[:, None, None]
        place, size = place_and_size(shown / (depth + distance[:, None, None, None]))
        nearer = torch.maximum(distance * size / spot[:, 2], least)
        shift = shift + (spot[:, :2] * nearer[:, None] - place * distance[:, None]) / focal[:, None]
        distance = nearer
    return distance, shift


def _panned(cameras: Cameras, joints_world: Tensor, draw: Draw, share: Tensor) -> Cameras:
    """Some of the cameras turn about their own vertical axis and bring the person slowly towards the middle; share (B,)
    says how likely each does."""
    pelvis = cameras.to_camera(joints_world)[..., H36M17.index("pelvis"), :]
    count, frames = pelvis.shape[:2]
    window = min(_PAN_FRAMES, frames)
    bearing = torch.atan2(pelvis[..., 0], pelvis[..., 2])[:, None]
    bearing = torch.nn.functional.pad(bearing, (window // 2, (window - 1) // 2), mode="replicate")
    bearing = torch.nn.functional.avg_pool1d(bearing, window, stride=1)[:, 0]
    angle = (draw.uniform((0.3, 1.0), count) * draw.share(share, count))[:, None] * bearing
    c, s, zero, one = angle.cos(), angle.sin(), torch.zeros_like(angle), torch.ones_like(angle)
    turn = torch.stack([c, zero, -s, zero, one, zero, s, zero, c], -1).unflatten(-1, (3, 3))
    return replace(cameras, R_camera_from_world=turn @ cameras.R_camera_from_world)
