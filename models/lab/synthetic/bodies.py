"""Other people's proportions on a captured motion: bone lengths change, bone directions (joint angles) do not.

What draws nothing takes arrays of numpy and of torch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....pipeline.core.layouts import H36M17
from ...common.vectors import Array, length, library_of, picked

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
STANDARD_SIZE_M = 3.9  # sum of the 16 bones of a person about 1.7 m tall


@dataclass(frozen=True)
class BodyRange:
    """What proportions are drawn from.

    limbs, trunk: standard deviation of the logarithm of a factor on the bones' lengths.
    hips, shoulders: hip and shoulder width over the sum of all bones, uniform. Captures of one laboratory share
        few skeletons, and 2D detectors put these joints wider than optical capture does.
    unchanged: share of windows that keep the captured body. mirrored: share that is mirrored left to right.
    """

    limbs: float = 0.05
    trunk: float = 0.05
    hips: tuple[float, float] = (0.033, 0.075)
    shoulders: tuple[float, float] = (0.055, 0.105)
    unchanged: float = 0.3
    mirrored: float = 0.5


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


def _summed(bones: Any) -> Any:
    """(...,) the lengths of bones (..., T, B, 3) together, averaged over time."""
    return length(bones).sum(-1).mean(-1)


def mirror(joints: Array) -> Array:
    """The mirror image of joints (..., 17, 3) in the plane x = 0, with left and right exchanged."""
    out: Any = picked(joints, H36M17.mirror.tolist())
    out[..., 0] *= -1
    return out


def drawn_factors(
    joints: Array,
    bodies: BodyRange,
    spread: Callable[[float], Array],
    within: Callable[[tuple[float, float]], Array],
) -> Array:
    """(..., 17) factors on the bone that ends in each joint of joints (..., T, 17, 3); left and right alike. spread:
    draws (...,) factors whose logarithms have that standard deviation; within: (...,) numbers of that range."""
    legs, arms = spread(bodies.limbs / 2), spread(bodies.limbs / 2)
    limbs = (("knee", legs), ("ankle", legs), ("elbow", arms), ("wrist", arms))
    of: dict[str, Any] = {part: limb * spread(bodies.limbs) for part, limb in limbs}
    for joint, std in (("spine", bodies.trunk), ("thorax", bodies.trunk), ("nose", 0.15), ("head", 0.15)):
        of[joint] = spread(std)
    size: Any = size_m(joints)
    for part, between in (("hip", bodies.hips), ("shoulder", bodies.shoulders)):
        width = length(vector(joints, f"r_{part}", f"l_{part}")).mean(-1)
        of[part] = within(between) * size / width.clip(1e-3)
    of["pelvis"] = library_of(joints).ones_like(size)
    return library_of(joints).stack([of[_without_side(joint)] for joint in H36M17.joints], -1)


def _without_side(joint: str) -> str:
    return joint.removeprefix("l_").removeprefix("r_")


def draw_factors(joints: np.ndarray, rng: np.random.Generator, bodies: BodyRange | None = None) -> np.ndarray:
    """(..., 17) of `drawn_factors`, 1 for a share of the windows."""
    bodies, lead = bodies or BodyRange(), joints.shape[:-3]
    factors = drawn_factors(
        joints,
        bodies,
        lambda std: np.exp(std * np.clip(rng.standard_normal(lead), -2, 2)),
        lambda between: np.asarray(rng.uniform(*between, size=lead)),
    )
    return np.where((rng.uniform(size=lead) < bodies.unchanged)[..., None], 1.0, factors)


def vary(joints: np.ndarray, rng: np.random.Generator, bodies: BodyRange | None = None) -> np.ndarray:
    """joints (..., T, 17, 3), +Z up, on other bodies, some mirrored; every window of the batch on its own."""
    bodies = bodies or BodyRange()
    out = resize(joints, draw_factors(joints, rng, bodies).astype(joints.dtype))
    flipped = rng.uniform(size=joints.shape[:-3]) < bodies.mirrored
    return np.where(flipped[..., None, None, None], mirror(out), out)
