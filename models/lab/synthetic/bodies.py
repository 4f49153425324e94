"""Other people's proportions on a captured motion: bone lengths change, bone directions (joint angles) do not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....pipeline.core.layouts import H36M17

# Child by parent, each parent before its children. "nose" and "head" hang on the thorax and the nose.
_TREE = {
    "r_hip": "pelvis", "r_knee": "r_hip", "r_ankle": "r_knee",
    "l_hip": "pelvis", "l_knee": "l_hip", "l_ankle": "l_knee",
    "spine": "pelvis", "thorax": "spine", "nose": "thorax", "head": "nose",
    "l_shoulder": "thorax", "l_elbow": "l_shoulder", "l_wrist": "l_elbow",
    "r_shoulder": "thorax", "r_elbow": "r_shoulder", "r_wrist": "r_elbow",
}  # fmt: skip
_CHILD = np.array(H36M17.indices(list(_TREE)))
_PARENT = np.array(H36M17.indices(list(_TREE.values())))
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


def bone_tree() -> tuple[list[int], list[int]]:
    """The rows of each bone's child and of its parent in H36M17, parents before their children."""
    return _CHILD.tolist(), _PARENT.tolist()


def size_m(joints: np.ndarray) -> np.ndarray:
    """(...,) a person's size: the sum of the 16 bone lengths, averaged over time; joints (..., T, 17, 3) metres."""
    bones = joints[..., _CHILD, :] - joints[..., _PARENT, :]
    return np.linalg.norm(bones, axis=-1).sum(axis=-1).mean(axis=-1)


def resize(joints: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """joints (..., T, 17, 3) with every bone's length multiplied; factors (..., 17) by the bone's child joint.

    Bone directions stay exactly. The root's path is multiplied by the change of leg length, so that the feet
    stay near the floor (z = 0 in a world frame) and a step stays a step.
    """
    bones = joints[..., _CHILD, :] - joints[..., _PARENT, :]
    scaled = bones * factors[..., None, _CHILD, None]
    leg = np.isin(np.array(H36M17.joints)[_CHILD], ["r_knee", "r_ankle", "l_knee", "l_ankle"])
    legs_before = np.linalg.norm(bones[..., leg, :], axis=-1).sum(axis=-1).mean(axis=-1)
    legs_after = np.linalg.norm(scaled[..., leg, :], axis=-1).sum(axis=-1).mean(axis=-1)
    out = np.empty_like(joints)
    root = H36M17.index("pelvis")
    out[..., root, :] = joints[..., root, :] * (legs_after / legs_before)[..., None, None]
    for bone, (child, parent) in enumerate(zip(_CHILD, _PARENT, strict=True)):
        out[..., child, :] = out[..., parent, :] + scaled[..., bone, :]
    return out


def mirror(joints: np.ndarray) -> np.ndarray:
    """The mirror image of joints (..., 17, 3) in the plane x = 0, with left and right exchanged."""
    return joints[..., H36M17.mirror, :] * np.array([-1, 1, 1], dtype=joints.dtype)


def draw_factors(joints: np.ndarray, rng: np.random.Generator, bodies: BodyRange | None = None) -> np.ndarray:
    """(..., 17) factors on the bone that ends in each joint; left and right alike."""
    bodies = bodies or BodyRange()
    lead = joints.shape[:-3]
    factors = np.ones((*lead, len(H36M17)))

    def spread(std: float) -> np.ndarray:
        return np.exp(std * np.clip(rng.standard_normal(lead), -2, 2))

    legs, arms = spread(bodies.limbs / 2), spread(bodies.limbs / 2)
    for part, limb in (("knee", legs), ("ankle", legs), ("elbow", arms), ("wrist", arms)):
        factors[..., H36M17.indices((f"l_{part}", f"r_{part}"))] = (limb * spread(bodies.limbs))[..., None]
    for joint, std in (("spine", bodies.trunk), ("thorax", bodies.trunk), ("nose", 0.15), ("head", 0.15)):
        factors[..., H36M17.index(joint)] = spread(std)
    size = size_m(joints)
    for part, between in (("hip", bodies.hips), ("shoulder", bodies.shoulders)):
        pair = H36M17.indices((f"l_{part}", f"r_{part}"))
        width = np.linalg.norm(joints[..., pair[0], :] - joints[..., pair[1], :], axis=-1).mean(axis=-1)
        factors[..., pair] = (rng.uniform(*between, lead) * size / width)[..., None]
    keep = rng.uniform(size=lead) < bodies.unchanged
    return np.where(keep[..., None], 1.0, factors)


def vary(joints: np.ndarray, rng: np.random.Generator, bodies: BodyRange | None = None) -> np.ndarray:
    """joints (..., T, 17, 3), +Z up, on other bodies, some mirrored; every window of the batch on its own."""
    bodies = bodies or BodyRange()
    out = resize(joints, draw_factors(joints, rng, bodies).astype(joints.dtype))
    flipped = rng.uniform(size=joints.shape[:-3]) < bodies.mirrored
    return np.where(flipped[..., None, None, None], mirror(out), out)
