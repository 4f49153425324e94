"""2D keypoints as detectors see them (the formula of models/lab/synthetic/keypoint_noise.py), and what spoils them
besides: the image's border, long occlusions, joints that a detector does not have, good and bad detectors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import torch
from pydantic import AfterValidator
from torch import Tensor

from .....pipeline.core.errors import InputError
from .....pipeline.core.layouts import H36M17
from ....common.vectors import length, picked
from ...common.toml_config import Share, Size
from ..keypoint_noise import (
    EXCHANGED_LIMBS,
    FAR_JOINTS,
    GOOD,
    HEAD_HEIGHT,
    HIDDEN_MISSING,
    Noise,
    confidence_of,
    derive,
    hidden_joints,
    in_profile,
)
from .draw import Draw

_GROUPS = (
    ("l_knee", "l_ankle"), ("r_knee", "r_ankle"), ("l_ankle", "r_ankle"),
    ("l_elbow", "l_wrist"), ("r_elbow", "r_wrist"),
    ("l_wrist", "r_wrist"), ("nose", "head"), ("l_knee", "r_knee", "l_ankle", "r_ankle"),
)  # fmt: skip

SLOW_S = 3.0  # MoveNet's and OpenPose's errors stay for seconds where a person holds a posture


def _known(joint: str) -> str:
    if joint not in H36M17.joints:
        raise InputError("bad-value", f"expected a joint of {', '.join(H36M17.joints)}")
    return joint


Joint = Annotated[str, AfterValidator(_known)]


@dataclass(frozen=True)
class Spoilt:
    """What spoils keypoints besides the formula, as shares of the windows.

    quality: spread (of the logarithm) of a window's noise, for detectors are not alike. good: a good detector's, with
    the errors, outliers, exchanges and gaps of GOOD. slow: standard deviation, as a share of the body's size, of an
    error that lasts SLOW_S, which the confidence does not know of. truncated: the image ends somewhere in the body,
    mostly below. occluded: a part of the body is not seen for long. absent: joints that the detector does not have at
    all, each by its own share.
    """

    quality: Size = 0.0
    good: Share = 0.0
    slow: Size = 0.0
    truncated: Share = 0.0
    occluded: Share = 0.0
    absent: dict[Joint, Share] = field(default_factory=dict)


def detect(
    pixels: Tensor, joints_camera: Tensor, draw: Draw, spoilt: Spoilt, fps: float, noise: Noise | None = None
) -> tuple[Tensor, Tensor]:
    """What a detector would answer. noise: the formula's constants.

    pixels: (B, T, 17, 2) exact projections of joints_camera (B, T, 17, 3), H36M17, metres, origin at the camera.
    -> keypoints (B, T, 17, 2) pixels, NaN where missing, and confidence (B, T, 17) in [0, 1].
    """
    noise = noise or Noise()
    count, frames, joints = pixels.shape[:3]
    size = (pixels.amax(2) - pixels.amin(2)).amax(-1)[..., None, None]
    hidden = hidden_joints(joints_camera)
    good = draw.share(spoilt.good, count, 1, 1) if spoilt.good else torch.zeros_like(hidden[:, :1, :1])

    def level(name: str) -> Tensor:
        """(B, 1, 1) a constant of the window's detector."""
        return torch.where(good, getattr(GOOD, name), getattr(noise, name))

    far_joints = torch.zeros(joints, dtype=torch.bool, device=draw.device)
    far_joints[H36M17.indices(FAR_JOINTS)] = True
    factor = torch.where(far_joints, level("far_joints"), 1.0)
    quality = (spoilt.quality * draw.normal(count, 1, 1, most=2)).exp()
    spread = (quality * torch.where(hidden, noise.hidden, 1.0) * factor)[..., None]
    error = (
        level("std")[..., None] * spread * _ar1(draw.normal(*pixels.shape), noise.correlation ** (30 / fps))
    )
    far = draw.share(level("outliers") * quality, count, frames, joints)
    angle = draw.uniform((0.0, 6.2832), count, frames, joints)
    jump = torch.where(far, draw.uniform(noise.outlier_size, count, frames, joints), 0.0)
    error = error + jump[..., None] * torch.stack([angle.cos(), angle.sin()], dim=-1)
    keypoints = pixels + error * size
    if spoilt.slow:
        lasting = _ar1(draw.normal(*pixels.shape), math.exp(-1 / (SLOW_S * fps)))
        keypoints = keypoints + spoilt.slow * spread * lasting * size
    confidence = confidence_of(length(error), hidden, draw.normal(count, frames, joints)).clamp(0.05, 1.0)

    profile = in_profile(joints_camera, noise.profile_cosine)
    for order in EXCHANGED_LIMBS:
        swap = draw.runs(level("swap_rate")[..., 0] * 30 / fps * profile, noise.swap_run * fps / 30) & profile
        keypoints = torch.where(swap[..., None, None], picked(keypoints, order), keypoints)
        confidence = torch.where(swap[..., None], confidence[..., order], confidence)

    if noise.derived:
        made = derive(keypoints, draw.uniform(HEAD_HEIGHT, count)[:, None, None])
        keypoints = torch.where(draw.share(noise.derived, count)[:, None, None, None], made, keypoints)

    rate = (level("missing_rate") * 30 / fps) * torch.where(hidden, HIDDEN_MISSING, 1.0)
    lost = draw.runs(rate.transpose(1, 2), noise.missing_run * fps / 30).transpose(1, 2)
    nobody = (level("absent_rate")[..., 0] * 30 / fps).expand(count, frames)
    lost = lost | draw.runs(nobody, noise.absent_run * fps / 30)[..., None]
    lost = (
        lost
        | _truncated(keypoints, draw, spoilt.truncated)
        | _occluded(draw, spoilt.occluded, count, frames, fps)
    )
    for joint, share in spoilt.absent.items():
        lost[..., H36M17.index(joint)] |= draw.share(share, count, 1)
    return torch.where(lost[..., None], torch.nan, keypoints), torch.where(lost, 0.0, confidence)


def _truncated(keypoints: Tensor, draw: Draw, share: float) -> Tensor:
    """(B, T, 17) True beyond a border that cuts off up to half of the body's extent over the window: below for most,
    else at the left or right; above never, for no lifter can do without the trunk."""
    count = len(keypoints)
    low, high = keypoints.amin(dim=(1, 2)), keypoints.amax(dim=(1, 2))
    cut = draw.uniform((0.0, 0.5), count)
    kind = draw.uniform((0.0, 1.0), count)
    below = keypoints[..., 1] > (high[:, 1] - cut * (high[:, 1] - low[:, 1]))[:, None, None]
    left = keypoints[..., 0] < (low[:, 0] + cut * (high[:, 0] - low[:, 0]))[:, None, None]
    right = keypoints[..., 0] > (high[:, 0] - cut * (high[:, 0] - low[:, 0]))[:, None, None]
    beyond = torch.where(
        (kind < 0.7)[:, None, None], below, torch.where((kind < 0.85)[:, None, None], left, right)
    )
    return beyond & draw.share(share, count)[:, None, None]


def _occluded(draw: Draw, share: float, count: int, frames: int, fps: float) -> Tensor:
    """(B, T, 17) True for a part of the body in runs of about two seconds."""
    rows = torch.zeros(len(_GROUPS), len(H36M17), dtype=torch.bool, device=draw.device)
    for i, group in enumerate(_GROUPS):
        rows[i, H36M17.indices(group)] = True
    start = torch.full((count, frames), 0.5 / fps, device=draw.device)
    start[:, 0] = 0.5
    when = draw.runs(start, 2.0 * fps) & draw.share(share, count, 1)
    return when[..., None] & rows[draw.integers(len(_GROUPS), count)][:, None]


def _ar1(white: Tensor, coefficient: float) -> Tensor:
    """Stationary AR(1) noise of unit variance along the time axis of white noise (B, T, J, 2)."""
    frame = torch.arange(white.shape[1], device=white.device)
    lag = frame[:, None] - frame
    weights = torch.where(lag >= 0, coefficient ** lag.clamp_min(0).float(), 0.0)
    weights[:, 1:] *= (1 - coefficient**2) ** 0.5
    return torch.einsum("ts,bsjk->btjk", weights, white)
