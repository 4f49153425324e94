"""Other people's proportions on a captured motion: bone lengths change, bone directions (joint angles) do not.
And other definitions of where a joint is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ....pipeline.core.layouts import H36M17
from ...common.vectors import Array, across, length, picked, unit
from ..common.config import Share, Size
from ..common.metrics import by_person
from ..mocap.clips import OWN_SKELETON, Clip, person
from .draw import Draw

# Child by parent, each parent before its children. "nose" and "head" hang on the thorax and the nose.
_TREE = {
    "r_hip": "pelvis", "r_knee": "r_hip", "r_ankle": "r_knee",
    "l_hip": "pelvis", "l_knee": "l_hip", "l_ankle": "l_knee",
    "spine": "pelvis", "thorax": "spine", "nose": "thorax", "head": "nose",
    "l_shoulder": "thorax", "l_elbow": "l_shoulder", "l_wrist": "l_elbow",
    "r_shoulder": "thorax", "r_elbow": "r_shoulder", "r_wrist": "r_elbow",
}  # fmt: skip
# Rows of each bone's ends in H36M17, parents before their children.
CHILDREN = H36M17.indices(list(_TREE))
PARENTS = H36M17.indices(list(_TREE.values()))
_LEGS = [bone for bone, joint in enumerate(_TREE) if joint[2:] in ("knee", "ankle")]
_PARENT_OF = H36M17.indices([_TREE.get(joint, joint) for joint in H36M17.joints])  # the pelvis's is itself
# Of each joint the same one on the left, or itself.
_LEFT = H36M17.indices([f"l_{joint[2:]}" if joint[:2] == "r_" else joint for joint in H36M17.joints])
_UPPER = [not joint.endswith(("pelvis", "hip", "knee", "ankle")) for joint in H36M17.joints]
STANDARD_SIZE_M = 3.9  # sum of the 16 bones of a person about 1.7 m tall


# Widths over the sum of all bones, uniform: 2D detectors put hips and shoulders wider than optical capture does.
_WIDTHS = {"hip": (0.033, 0.075), "shoulder": (0.055, 0.105)}


@dataclass(frozen=True)
class BodyRange:
    """What proportions are drawn from, for captures of one laboratory share few skeletons."""

    limbs: Size = 0.05  # standard deviation of the logarithm of a factor on the bones' lengths
    trunk: Size = 0.05  # the same
    unchanged: Share = 0.3  # share of windows that keep the captured body
    mirrored: Share = 0.5  # share that is mirrored left to right


def size_m(joints: Array) -> Array:
    """(...,) a person's size: the sum of the 16 bone lengths, averaged over time; joints (..., T, 17, 3) metres."""
    return _summed(picked(joints, CHILDREN) - picked(joints, PARENTS))


def resize(joints: Array, factors: Array) -> Array:
    """joints (..., T, 17, 3) with every bone's length multiplied; factors (..., 17) by the bone's child joint.

    Bone directions stay exactly. The root's path is multiplied by the change of leg length, so that the feet
    stay near the floor (z = 0 in a world frame) and a step stays a step.
    """
    bones = picked(joints, CHILDREN) - picked(joints, PARENTS)
    scaled = bones * factors[..., None, CHILDREN, None]
    before, after = (_summed(picked(part, _LEGS)) for part in (bones, scaled))
    out: Any = joints * (after / before)[..., None, None, None]  # of which the pelvis stays
    for bone, (child, parent) in enumerate(zip(CHILDREN, PARENTS, strict=True)):
        out[..., child, :] = out[..., parent, :] + scaled[..., bone, :]
    return out


def vector(joints: Array, start: str, end: str) -> Array:
    """(..., 3) from one joint to another of joints (..., 17, 3)."""
    return joints[..., H36M17.index(end), :] - joints[..., H36M17.index(start), :]


def body_frame(leftward: Tensor, upward: Tensor) -> Tensor:
    """R_world_from_body (..., 3, 3) of vectors (..., 3) that point about there: columns front, left, up."""
    left = unit(leftward)
    up = across(upward, left)
    return torch.stack([torch.cross(left, up, dim=-1), left, up], dim=-1)


def _summed(bones: Any) -> Any:
    """(...,) the lengths of bones (..., T, B, 3) together, averaged over time."""
    return length(bones).sum(-1).mean(-1)


def mirror(joints: Array) -> Array:
    """The mirror image of joints (..., 17, 3) in the plane x = 0, with left and right exchanged."""
    out: Any = picked(joints, H36M17.mirror.tolist())
    out[..., 0] *= -1
    return out


def drawn_factors(joints: Tensor, draw: Draw, bodies: BodyRange) -> Tensor:
    """(B, 17) factors on the bone that ends in each joint of joints (B, T, 17, 3); left and right alike."""
    count = len(joints)

    def spread(std: float) -> Tensor:
        return (std * draw.normal(count, most=2)).exp()

    legs, arms = spread(bodies.limbs / 2), spread(bodies.limbs / 2)
    limbs = (("knee", legs), ("ankle", legs), ("elbow", arms), ("wrist", arms))
    of = {part: limb * spread(bodies.limbs) for part, limb in limbs}
    for joint, std in (("spine", bodies.trunk), ("thorax", bodies.trunk), ("nose", 0.15), ("head", 0.15)):
        of[joint] = spread(std)
    size = size_m(joints)
    for part, between in _WIDTHS.items():
        width = length(vector(joints, f"r_{part}", f"l_{part}")).mean(-1)
        of[part] = draw.uniform(between, count) * size / width.clamp_min(1e-3)
    of["pelvis"] = torch.ones_like(size)
    return torch.stack([of[joint.removeprefix("l_").removeprefix("r_")] for joint in H36M17.joints], -1)


def bone_lengths(joints: Tensor) -> Tensor:
    """(..., T, 17) length of the bone that ends in each joint of (..., T, 17, 3); 0 at the pelvis."""
    return length(joints - picked(joints, _PARENT_OF))


def combine(lower: Tensor, upper: Tensor) -> Tensor:
    """The legs and the path of one motion under the trunk, head and arms of another; both (..., T, 17, 3), +Z up.

    The upper body is turned about the vertical in every frame until both motions' hips point the same way. A motion
    whose hip axis is ever steeper than 60 degrees keeps its own upper body: it has no such direction.
    """
    hips = [vector(motion, "r_hip", "l_hip") for motion in (lower, upper)]
    level = [length(axis[..., :2]) / length(axis).clamp_min(1e-9) for axis in hips]
    turn = torch.atan2(hips[0][..., 1], hips[0][..., 0]) - torch.atan2(hips[1][..., 1], hips[1][..., 0])
    c, s = turn.cos()[..., None], turn.sin()[..., None]
    pelvis = [H36M17.index("pelvis")]
    x, y, z = (upper - upper[..., pelvis, :]).unbind(-1)
    turned = torch.stack([c * x - s * y, s * x + c * y, z], dim=-1) + lower[..., pelvis, :]
    fits = (torch.minimum(*level) > 0.5).all(dim=-1)[..., None, None, None]
    return torch.where(fits & torch.tensor(_UPPER, device=lower.device)[:, None], turned, lower)


def proportions(clips: Sequence[Clip]) -> Tensor:
    """(people, 17) mean bone lengths in metres of the clips' people who come with their own skeleton; may be empty."""
    rows = by_person(
        (person(clip) or clip.subject, bone_lengths(torch.from_numpy(clip.joints)).mean(0).numpy())
        for clip in clips
        if clip.source in OWN_SKELETON
    )
    return torch.from_numpy(np.array([*rows.values()], dtype=np.float32).reshape(-1, len(H36M17)))


def vary(
    joints: Tensor, draw: Draw, bodies: BodyRange, people: Tensor | None = None, real: float = 0.0
) -> Tensor:
    """joints (B, T, 17, 3), +Z up, on other bodies, some mirrored. people: of `proportions`; real: share of windows
    whose lengths are one of theirs (left and right alike, every limb a few per cent off) instead of drawn."""
    count = len(joints)
    factors = drawn_factors(joints, draw, bodies)
    if real and people is not None and len(people):
        now = bone_lengths(joints).mean(1)
        wanted = people[draw.integers(len(people), count)]
        spread = (0.03 * draw.normal(count, len(H36M17), most=2)).exp()[:, _LEFT]
        wanted = (wanted + wanted[:, H36M17.mirror.tolist()]) / 2 * spread
        theirs = torch.where(now > 1e-3, wanted / now.clamp_min(1e-3), 1.0)
        factors = torch.where(draw.share(real, count, 1), theirs, factors)
    factors = torch.where(draw.share(bodies.unchanged, count, 1), 1.0, factors)
    out = resize(joints, factors)
    return torch.where(draw.share(bodies.mirrored, count)[:, None, None, None], mirror(out), out)


_REDEFINED_M = 0.02  # standard deviation of where sources put a joint


def redefined(joints: Tensor, draw: Draw, share: float) -> Tensor:
    """joints (B, T, 17, 3) as another source defines them, for a share of the windows: spine, thorax, nose and head
    moved in the sagittal plane, hips and shoulders across and along the trunk; the same in every frame of a window."""
    count = len(joints)
    leftward = vector(joints, "r_shoulder", "l_shoulder") + vector(joints, "r_hip", "l_hip")
    axes = body_frame(leftward, vector(joints, "pelvis", "thorax"))
    std = _REDEFINED_M * draw.share(share, count, 1, 1)
    offsets = joints.new_zeros(count, len(H36M17), 3)
    middle = H36M17.indices(("spine", "thorax", "nose", "head"))
    offsets[:, middle] = draw.normal(count, len(middle), 3, most=2) * joints.new_tensor([1.0, 0.0, 1.0])
    for part in ("hip", "shoulder"):
        moved = 0.6 * draw.normal(count, 3, most=2)
        for side, sign in (("l", 1.0), ("r", -1.0)):
            offsets[:, H36M17.index(f"{side}_{part}")] = moved * joints.new_tensor([1.0, sign, 1.0])
    return joints + torch.einsum("btij,bkj->btki", axes, std * offsets)
