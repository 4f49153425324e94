"""2D keypoints as detectors see them: exact projections in, noisy keypoints with confidences out.

The formula, for a person whose box has a longer side of s pixels (the height of a standing person's box):

- position: Gaussian with a standard deviation of 1.5 % of s on x and on y, times 1.5 at wrists and ankles, times
  2 while the joint is hidden behind the body; an AR(1) process in time with coefficient 0.8 at 30 fps;
- outliers: 0.3 % of the joints of a frame lie another 10 to 30 % of s away;
- left and right: in profile, legs or arms are exchanged for runs of frames;
- missing: single joints for runs of frames, hidden ones three times as often; rarely the whole person;
- confidence: falls with the joint's error and when hidden; 0 and NaN coordinates when missing.

Training adds what else spoils keypoints (Spoilt): the image's border, long occlusions, joints that a detector does not
have, good and bad detectors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor

from ....pipeline.core.layouts import H36M17
from ...common.vectors import Array, dot, length, picked
from ..common.config import Share, Size
from .bodies import vector
from .draw import Draw

FAR_JOINTS = ("l_wrist", "r_wrist", "l_ankle", "r_ankle")
HIDDEN_MISSING = 3.0  # times as often missing when hidden
# What hides joints: thick lines between joints, with their radius in trunk lengths.
SOLIDS = (
    ("pelvis", "thorax", 0.28), ("thorax", "head", 0.18),
    ("l_hip", "l_knee", 0.14), ("r_hip", "r_knee", 0.14), ("l_knee", "l_ankle", 0.10), ("r_knee", "r_ankle", 0.10),
)  # fmt: skip
HEAD_HEIGHT = (0.4, 1.0)  # from the middle of the ears to the top, over nose to top

# Orders of joints, with the legs exchanged and with the arms.
EXCHANGED_LIMBS = [
    [int(H36M17.mirror[row]) if joint[2:] in limb else row for row, joint in enumerate(H36M17.joints)]
    for limb in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist"))
]


@dataclass(frozen=True)
class Noise:
    """Constants of the formula at the head of this file. Lengths are shares of the box's longer side; rates are
    per frame at 30 fps; runs are mean lengths in frames at 30 fps."""

    std: float = 0.015
    correlation: float = 0.8
    far_joints: float = 1.5
    hidden: float = 2.0
    outliers: float = 0.003
    outlier_size: tuple[float, float] = (0.10, 0.30)
    swap_rate: float = 0.02
    swap_run: float = 8.0
    profile_cosine: float = 0.85
    missing_rate: float = 0.001
    missing_run: float = 10.0
    absent_rate: float = 0.0003
    absent_run: float = 8.0


# As good detectors have it: OpenPose's keypoints of a real take lie 1.0 to 1.7 % from the truth at wrists and ankles as
# at other joints, where its cameras are known best (docs/research.md).
GOOD = Noise(
    std=0.012, far_joints=1.0, outliers=0.001, swap_rate=0.005, missing_rate=0.0003, absent_rate=0.0001
)


def hidden_joints(joints_camera: Array) -> Array:
    """(..., J) True where the trunk, the head or a leg is between the camera and the joint.

    joints_camera: (..., 17, 3) metres, origin at the camera. Trunk, head and legs are thick lines; a joint at an
    end of a line is not hidden by it.
    """
    depth = 1 * joints_camera[..., 2]  # a copy, whose rows lie together
    rays = [joints_camera[..., i] / depth for i in (0, 1)]
    trunk = length(vector(joints_camera, "pelvis", "thorax"))
    hidden: Any = False
    for start, end, radius in SOLIDS:
        a, b = H36M17.index(start), H36M17.index(end)
        (x, line_x), (y, line_y) = (
            (ray - ray[..., a, None], (ray[..., b] - ray[..., a])[..., None]) for ray in rays
        )
        along = ((x * line_x + y * line_y) / (line_x**2 + line_y**2).clip(1e-9)).clip(0, 1)
        apart = (x - along * line_x) ** 2 + (y - along * line_y) ** 2
        here = depth[..., a, None] * (1 - along) + depth[..., b, None] * along
        reach = (radius * trunk)[..., None]
        behind = (apart < (reach / here) ** 2) & (depth > here + reach)
        behind[..., [a, b]] = False
        hidden = hidden | behind
    return hidden


_GROUPS = (
    ("l_knee", "l_ankle"), ("r_knee", "r_ankle"), ("l_ankle", "r_ankle"),
    ("l_elbow", "l_wrist"), ("r_elbow", "r_wrist"),
    ("l_wrist", "r_wrist"), ("nose", "head"), ("l_knee", "r_knee", "l_ankle", "r_ankle"),
)  # fmt: skip

SLOW_S = 3.0  # MoveNet's and OpenPose's errors stay for seconds where a person holds a posture


@dataclass(frozen=True)
class Spoilt:
    """What spoils keypoints besides the formula, as shares of the windows."""

    quality: Size = 0.0  # spread (of the logarithm) of a window's noise, for detectors are not alike
    good: Share = 0.0  # a good detector's, with the errors, outliers, exchanges and gaps of GOOD
    # Standard deviation, of the body's size, of an error that lasts SLOW_S, which the confidence does not know of.
    slow: Size = 0.0
    truncated: Share = 0.0  # the image ends somewhere in the body, mostly below
    occluded: Share = 0.0  # a part of the body is not seen for long
    absent: dict[str, Share] = field(default_factory=dict)  # joints that the detector does not have at all
    # Pelvis, thorax and spine are made from shoulders and hips, as remap does for detectors that have none, and
    # the head lies between the ears' middle and its top.
    derived: Share = 0.0


def detect(
    pixels: Tensor,
    joints_camera: Tensor,
    draw: Draw,
    fps: float = 30.0,
    noise: Noise | None = None,
    spoilt: Spoilt | None = None,
) -> tuple[Tensor, Tensor]:
    """What a detector would answer. noise: the formula's constants. spoilt: what spoils keypoints besides.

    pixels: (B, T, 17, 2) exact projections of joints_camera (B, T, 17, 3), H36M17, metres, origin at the camera.
    -> keypoints (B, T, 17, 2) pixels, NaN where missing, and confidence (B, T, 17) in [0, 1].
    """
    noise = noise or Noise()
    count, frames, joints = pixels.shape[:3]
    size = (pixels.amax(2) - pixels.amin(2)).amax(-1)[..., None, None]
    hidden = hidden_joints(joints_camera)
    good, quality = torch.zeros_like(hidden[:, :1, :1]), torch.ones_like(pixels[:, :1, :1, 0])
    if spoilt is not None:
        good = draw.share(spoilt.good, count, 1, 1)
        quality = (spoilt.quality * draw.normal(count, 1, 1, most=2)).exp()

    def level(name: str) -> Tensor:
        """(B, 1, 1) a constant of the window's detector."""
        return torch.where(good, *(pixels.new_tensor(getattr(of, name)) for of in (GOOD, noise)))

    far_joints = torch.tensor([joint in FAR_JOINTS for joint in H36M17.joints], device=draw.device)
    factor = torch.where(far_joints, level("far_joints"), 1.0)
    spread = (quality * torch.where(hidden, noise.hidden, 1.0) * factor)[..., None]
    error = spread * draw.ar1(noise.correlation ** (30 / fps), *pixels.shape) * level("std")[..., None]
    far = draw.share(level("outliers") * quality, count, frames, joints)
    angle = draw.uniform((0.0, math.tau), count, frames, joints)
    jump = torch.where(far, draw.uniform(noise.outlier_size, count, frames, joints), 0.0)
    error = error + jump[..., None] * torch.stack([angle.cos(), angle.sin()], dim=-1)
    keypoints = pixels + error * size
    if spoilt is not None and spoilt.slow:
        lasting = draw.ar1(math.exp(-1 / (SLOW_S * fps)), *pixels.shape)
        keypoints = keypoints + spoilt.slow * spread * lasting * size
    seen = draw.normal(count, frames, joints)
    confidence = (0.9 - 5.0 * length(error) - 0.2 * hidden.to(seen) + 0.06 * seen).clamp(0.05, 1.0)

    profile = in_profile(joints_camera, noise.profile_cosine)
    for order in EXCHANGED_LIMBS:
        swap = draw.runs(level("swap_rate")[..., 0] * profile * 30 / fps, noise.swap_run * fps / 30)
        keypoints = torch.where(swap[..., None, None], picked(keypoints, order), keypoints)
        confidence = torch.where(swap[..., None], confidence[..., order], confidence)

    if spoilt is not None and spoilt.derived:
        made = derive(keypoints, draw.uniform(HEAD_HEIGHT, count)[:, None, None])
        keypoints = torch.where(draw.share(spoilt.derived, count)[:, None, None, None], made, keypoints)

    rate = level("missing_rate") * torch.where(hidden, HIDDEN_MISSING, 1.0) * 30 / fps
    lost = draw.runs(rate.transpose(1, 2), noise.missing_run * fps / 30).transpose(1, 2)
    nobody = (level("absent_rate")[..., 0] * 30 / fps).expand(count, frames)
    lost = lost | draw.runs(nobody, noise.absent_run * fps / 30)[..., None]
    if spoilt is not None:
        lost = lost | _truncated(keypoints, draw, spoilt.truncated)
        lost = lost | _occluded(draw, spoilt.occluded, count, frames, fps)
        for joint, share in spoilt.absent.items():
            lost[..., H36M17.index(joint)] |= draw.share(share, count, 1)
    return torch.where(lost[..., None], torch.nan, keypoints), torch.where(lost, 0.0, confidence)


def in_profile(joints_camera: Array, cosine: float = Noise.profile_cosine) -> Array:
    """(..., T) True where hips and shoulders together point along the view: |cos| of the angle above `cosine`."""
    aside: Any = vector(joints_camera, "r_hip", "l_hip") + vector(joints_camera, "r_shoulder", "l_shoulder")
    view = joints_camera[..., H36M17.index("pelvis"), :]
    return abs(dot(aside, view)) > cosine * length(aside) * length(view)


def derive(keypoints: Array, head_height: Array) -> Array:
    """keypoints (..., 17, 2) with pelvis and thorax in the middle of hips and shoulders, the spine between, the head
    between nose and top, head_height (...,) of the way."""
    out: Any = 1 * keypoints
    shoulders, pelvis = (
        picked(keypoints, H36M17.indices((f"l_{part}", f"r_{part}"))).mean(-2) for part in ("shoulder", "hip")
    )
    nose, top = keypoints[..., H36M17.index("nose"), :], keypoints[..., H36M17.index("head"), :]
    out[..., H36M17.index("head"), :] = nose + head_height * (top - nose)
    for joint, place in (("pelvis", pelvis), ("spine", (shoulders + pelvis) / 2), ("thorax", shoulders)):
        out[..., H36M17.index(joint), :] = place
    return out


def _truncated(keypoints: Tensor, draw: Draw, share: float) -> Tensor:
    """(B, T, 17) True beyond a border that cuts off up to half of the body's extent over the window: below for most,
    else at the left or right; above never, for no lifter can do without the trunk."""
    count = len(keypoints)
    low, high = keypoints.amin(dim=(1, 2), keepdim=True), keypoints.amax(dim=(1, 2), keepdim=True)
    off = draw.uniform((0.0, 0.5), count, 1, 1, 1) * (high - low)
    kind = draw.uniform((0.0, 1.0), count, 1, 1)
    (left, _), (right, below) = (part.unbind(-1) for part in (keypoints < low + off, keypoints > high - off))
    beyond = torch.where(kind < 0.7, below, torch.where(kind < 0.85, left, right))
    return beyond & draw.share(share, count, 1, 1)


def _occluded(draw: Draw, share: float, count: int, frames: int, fps: float) -> Tensor:
    """(B, T, 17) True for a part of the body in runs of about two seconds."""
    parts = torch.tensor([[joint in of for joint in H36M17.joints] for of in _GROUPS], device=draw.device)
    start = torch.full((count, frames), 0.5 / fps, device=draw.device)
    start[:, 0] = 0.5
    when = draw.runs(start, 2.0 * fps) & draw.share(share, count, 1)
    return when[..., None] & parts[draw.integers(len(_GROUPS), count)][:, None]
