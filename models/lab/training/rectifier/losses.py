"""The paper's losses as functions. Canonical poses are (B, 17, 3) in BODY, metres; rotations (B, 3, 3)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from .....pipeline.core.layouts import H36M17
from .net import Answer, GraphBranch, PCNet, rotate

_BONES = [H36M17.indices(bone) for bone in H36M17.bones]
_ANGLES = [
    H36M17.indices([f"{side}_{part}" for part in parts])
    for side in "lr"
    for parts in (
        ("shoulder", "elbow", "wrist"),
        ("hip", "knee", "ankle"),
        ("shoulder", "hip", "knee"),
        ("hip", "shoulder", "elbow"),
    )
]


@dataclass(frozen=True)
class Weights:
    """Of the terms of the loss; the defaults are the paper's, but for `regular` and `error`, which it does not give.

    With the residual off, cycle and perceptual do not depend on the network: R R^T X is X, and turning a body
    changes neither its bones nor its angles.
    """

    pose: float = 1.0
    rotation: float = 1.0
    cycle: float = 0.25
    perceptual: float = 0.15
    regular: float = 1e-3
    error: float = 0.1


@dataclass(frozen=True, eq=False)
class Truth:
    """joints: (B, 17, 3) CAMERA axes, without what spoilt the network's input, relative to the pelvis.
    R: (B, 3, 3) R_camera_from_body. valid: (B, 17), 1 where the network was told the joint."""

    joints: Tensor
    R: Tensor
    valid: Tensor

    @property
    def canonical(self) -> Tensor:
        return rotate(self.R.mT, self.joints)


def total(net: PCNet, answer: Answer, joints: Tensor, truth: Truth, weights: Weights) -> Tensor:
    """The weighted sum of what follows; joints: the network's input, relative to the pelvis."""
    there = truth.valid[..., None]
    angle = geodesic(answer.R, truth.R)
    loss = weights.rotation * angle.mean() + weights.error * error_likelihood(answer.error_deg, angle)
    if weights.pose:
        # With the residual off no rotation can take an estimator's own error away: it is judged on what it was given.
        target = truth.canonical if answer.residual is not None else rotate(truth.R.mT, joints)
        loss = loss + weights.pose * pose(answer.canonical * there, target * there)
    if answer.residual is not None:
        loss = loss + weights.cycle * cycle(answer.R, answer.canonical, joints * there)
        loss = loss + weights.perceptual * perceptual(answer.canonical, truth.canonical, truth.valid)
    if weights.regular:
        loss = loss + weights.regular * regular(net, answer)
    return loss


def pose(canonical: Tensor, truth: Tensor) -> Tensor:
    """mean_j |x_j - y_j|^2, square metres."""
    return (canonical - truth).square().sum(-1).mean()


def geodesic(R_1: Tensor, R_2: Tensor) -> Tensor:
    """(B,) angle between rotations in radians: atan2(|skew part|, (trace - 1) / 2) of R_1^T R_2.

    The gradient is finite everywhere, at 0 and 180 degrees too, where arccos has none.
    """
    difference = (R_1[..., :, None] * R_2[..., None, :]).sum(-3)
    skew = difference - difference.mT
    sine = torch.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], -1) / 2
    cosine = (difference.diagonal(dim1=-2, dim2=-1).sum(-1) - 1) / 2
    return torch.atan2((sine.square().sum(-1) + 1e-12).sqrt(), cosine)


def cycle(R: Tensor, canonical: Tensor, joints: Tensor) -> Tensor:
    """mean_j |R x_j - y_j|^2: what the canonical pose becomes when it is turned back, against the input."""
    return (rotate(R, canonical) - joints).square().sum(-1).mean()


def perceptual(canonical: Tensor, truth: Tensor, valid: Tensor | None = None) -> Tensor:
    """Mean difference of bone lengths (metres) plus that of joint angles (radians): elbows, knees, hips, shoulders."""
    valid = torch.ones_like(truth[..., 0]) if valid is None else valid
    bones, angles = (torch.tensor(rows, device=truth.device) for rows in (_BONES, _ANGLES))
    there = [valid[:, rows].prod(-1) for rows in (bones, angles)]
    lengths = (_lengths(canonical, bones) - _lengths(truth, bones)).abs() * there[0]
    turned = (_angles(canonical, angles) - _angles(truth, angles)).abs() * there[1]
    return lengths.mean() + turned.mean()


def regular(net: PCNet, answer: Answer) -> Tensor:
    """Residual L2, distance of the learned graph from the skeleton's, and likeness of the attention heads."""
    loss = answer.R.new_zeros(())
    if answer.residual is not None:
        loss = loss + answer.residual.square().sum(-1).mean()
    for module in net.modules():
        if isinstance(module, GraphBranch):
            loss = loss + (module.learned - module.skeleton).square().mean()
    if answer.attention is not None:
        loss = loss + attention_likeness(answer.attention)
    return loss


def attention_likeness(attention: Tensor) -> Tensor:
    """Mean cosine between the maps of different heads; 0 when no two heads look at the same joints. (B, H, 17, 17)."""
    maps = torch.nn.functional.normalize(attention.float().flatten(2), dim=-1)
    likeness = maps @ maps.mT
    heads = likeness.shape[-1]
    return (likeness.sum((-2, -1)) - heads).mean() / max(heads * (heads - 1), 1)


def error_likelihood(expected_deg: Tensor, angle: Tensor) -> Tensor:
    """Exponential likelihood log(e) + a / e: least where e is the mean of the true angles a (given in radians)."""
    return (expected_deg.log() + angle.detach().rad2deg() / expected_deg).mean()


def _lengths(joints: Tensor, bones: Tensor) -> Tensor:
    bone = joints[:, bones[:, 0]] - joints[:, bones[:, 1]]
    return (bone.square().sum(-1) + 1e-12).sqrt()


def _angles(joints: Tensor, triples: Tensor) -> Tensor:
    """(B, angles) at the middle joint, radians."""
    a = joints[:, triples[:, 0]] - joints[:, triples[:, 1]]
    b = joints[:, triples[:, 2]] - joints[:, triples[:, 1]]
    sine = (torch.linalg.cross(a, b).square().sum(-1) + 1e-12).sqrt()
    return torch.atan2(sine, (a * b).sum(-1))
