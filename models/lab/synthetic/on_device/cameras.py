"""Virtual cameras around motion capture, for a batch of windows (see models/lab/synthetic/cameras.py for the
conventions)."""

from __future__ import annotations

import torch
from torch import Tensor

from .....pipeline.core.camera import view_rotation
from .....pipeline.core.layouts import H36M17, LIMBS
from ....common.vectors import dot, picked, rotate, transpose
from ..cameras import IMAGE_SIZES, Cameras, ViewRange
from ..places import PLACE_SPREAD, PLACES, SIZE_SPREAD, TRUNK
from .draw import Draw

_AIM_FRAMES = 8  # of a window, about: so many tell its place and size
_AIMS = 4  # rounds; each leaves about a tenth of what was off


def place(
    joints_world: Tensor,
    draw: Draw,
    typical: ViewRange,
    wild: ViewRange,
    share_typical: float,
    share_placed: float = 0.0,
) -> Cameras[Tensor]:
    """One camera a window, somewhere from which every joint of every frame is inside the image; a share of them from
    the one range, the rest from the other. From either, a share have the person where people are in real videos, and as
    large (models/lab/synthetic/places.py), or as near to that as everything is inside; they do not pan.
    joints_world: (B, T, 17, 3) metres, +Z up."""
    count = len(joints_world)
    usual = draw.share(share_typical, count)

    def either(name: str, log: bool = False) -> Tensor:
        a, b = (
            (draw.log_uniform if log else draw.uniform)(getattr(views, name), count)
            for views in (typical, wild)
        )
        return torch.where(usual, a, b)

    sizes = torch.tensor(IMAGE_SIZES, dtype=torch.float32, device=draw.device)
    size = sizes[draw.integers(len(sizes), count)]
    placed, spot = torch.zeros_like(usual), None
    if share_placed:
        placed, spot = draw.share(share_placed, count), _spots(draw, count)
        tall = torch.stack([spot[:, 3], 1 / spot[:, 3]], dim=-1).clamp_max(1) * max(IMAGE_SIZES[0])
        size = torch.where(placed[:, None], tall, size)
    focal = either("focal", log=True)
    focal_px = focal * size.amax(-1)
    angles_deg = (either(f"{name}_deg").cpu().numpy() for name in ("yaw", "pitch", "roll"))
    R = torch.from_numpy(view_rotation(*angles_deg)).float().to(draw.device)
    points = joints_world.flatten(1, 2)
    centre = (points.amin(1) + points.amax(1)) / 2
    q = rotate(R, points - centre[:, None])
    depth = q[..., 2]
    half = size / 2 / focal_px[:, None] * (1 - wild.margin)
    needed = q[..., :2].abs() / half[:, None] - depth[..., None]
    least = torch.maximum(needed.amax(dim=(1, 2)), wild.nearest_m - depth.amin(1))
    metres = draw.log_uniform(typical.distance_m or (1.0, 1.0), count)
    distance = torch.where(
        usual, torch.maximum(metres, 1.02 * least), least * draw.log_uniform(wild.distance, count)
    )
    aimed = None
    if spot is not None:
        near, aimed = _aimed(q, focal, spot, least)
        distance = torch.where(placed, near, distance)
    room = (distance[:, None] + depth)[..., None] * half[:, None]
    low, high = (-room - q[..., :2]).amax(1), (room - q[..., :2]).amin(1)
    shift = low + draw.uniform((0.0, 1.0), count, 2) * (high - low)
    if aimed is not None:
        shift = torch.where(placed[:, None], torch.minimum(torch.maximum(aimed, low), high), shift)
    offset = torch.cat([shift, distance[:, None]], dim=-1)
    position = centre - rotate(transpose(R), offset[:, None])[:, 0]
    cameras = Cameras(R[:, None], position, focal_px, size)
    return _panned(cameras, joints_world, draw, wild.pans * ~placed) if wild.pans else cameras


def place_and_size(points: Tensor) -> tuple[Tensor, Tensor]:
    """What a row of places.PLACES says, of joints LIMBS (B, T, 12, 2) from the image's middle in longer image sides:
    (B, 2) and (B,), means over the frames."""
    middle = picked(points, TRUNK).mean(-2)
    off = points - middle[..., None, :]
    return middle.mean(1), dot(off, off).mean(-1).sqrt().mean(-1)


def _spots(draw: Draw, count: int) -> Tensor:
    """(B, 4) rows of PLACES and what lies about them; as many to the left as to the right."""
    rows = torch.tensor(PLACES, device=draw.device)[draw.integers(len(PLACES), count)]
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
        seen = aside + (focal[:, None] * shift)[:, None, None]
        place, size = place_and_size(seen / (depth + distance[:, None, None, None]))
        nearer = torch.maximum(distance * size / spot[:, 2], least)
        shift = shift + (spot[:, :2] * nearer[:, None] - place * distance[:, None]) / focal[:, None]
        distance = nearer
    return distance, shift


def _panned(cameras: Cameras[Tensor], joints_world: Tensor, draw: Draw, share: Tensor) -> Cameras[Tensor]:
    """Some of the cameras turn about their own vertical axis and bring the person slowly towards the middle; share (B,)
    says how likely each does."""
    pelvis = cameras.to_camera(joints_world)[..., H36M17.index("pelvis"), :]
    count, frames = pelvis.shape[:2]
    window = min(61, frames)
    bearing = torch.atan2(pelvis[..., 0], pelvis[..., 2])[:, None]
    bearing = torch.nn.functional.pad(bearing, (window // 2, (window - 1) // 2), mode="replicate")
    bearing = torch.nn.functional.avg_pool1d(bearing, window, stride=1)[:, 0]
    angle = (draw.uniform((0.3, 1.0), count) * draw.share(share, count))[:, None] * bearing
    return cameras.panned(angle)
