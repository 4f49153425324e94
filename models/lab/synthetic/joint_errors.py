"""What lifters do to 3D joints: noise, limbs turned over in depth, joints that are missing."""

from __future__ import annotations

import torch
from torch import Tensor

from ....pipeline.core.layouts import H36M17
from .draw import Draw

_FLIPPED = {
    f"{side}_{joint}": [f"{side}_{part}" for part in below]
    for side in "lr"
    for joint, below in {
        "hip": ("knee", "ankle"), "knee": ("ankle",), "shoulder": ("elbow", "wrist"), "elbow": ("wrist",),
    }.items()
}  # fmt: skip


def flipped(joints: Tensor, draw: Draw, share: float) -> Tensor:
    """joints (B, 17, 3) in CAMERA axes, limb bones of a share of the bodies turned over in depth, as lifters do to what
    the image cannot tell; the image stays the same."""
    out = joints.clone()
    some = draw.share(share, len(out))
    for joint, below in _FLIPPED.items():
        at, rows = H36M17.index(joint), H36M17.indices(below)
        change = -2 * (out[:, rows[0], 2] - out[:, at, 2]) * (some & draw.share(0.2, len(out)))
        out[:, rows, 2] += change[:, None]
    return out


def noisy(joints: Tensor, draw: Draw, share: float, most_m: float) -> Tensor:
    """joints (B, 17, 3) in CAMERA axes, a share of the bodies with Gaussian noise of a standard deviation of up to
    most_m, twice that in depth; relative to the pelvis, whose own noise thereby is all joints'."""
    count = len(joints)
    std = draw.uniform((0.0, most_m), count, 1, 1) * draw.share(share, count, 1, 1)
    out = joints + std * draw.normal(*joints.shape) * torch.tensor([1.0, 1.0, 2.0], device=joints.device)
    return out - out[:, [H36M17.index("pelvis")]]


def present(draw: Draw, count: int, missing: float) -> Tensor:
    """(count, 17) False for about one to six joints of a share of the frames, never for the pelvis."""
    gone = draw.share(draw.uniform((0.05, 0.35), count, 1), count, len(H36M17)) & draw.share(
        missing, count, 1
    )
    gone[:, H36M17.index("pelvis")] = False
    return ~gone
