"""Poses to measure a rectifier on where no motion capture is at hand: a standard body that moves its limbs."""

from __future__ import annotations

import numpy as np

from ..pipeline.anthropometry import SEGMENTS
from ..pipeline.layouts import H36M17
from .pcnet_views import redefined, seen, swing, views

_STATURE_M = 1.7
_NOISE_M = 0.02
_MISSING = 0.02
_SQUAT_DEG = 90.0  # thighs and, behind them, shins turn by up to this
# Directions of an upright body that faces -x, +Z up; the bones without a length of their own get a rough one.
_DIRECTION = {"r_hip": (0, 1, 0), "l_hip": (0, -1, 0), "r_shoulder": (0, 1, 0), "l_shoulder": (0, -1, 0)}
_DIRECTION |= {joint: (0, 0, 1) for joint in ("spine", "thorax", "head")} | {"nose": (-0.6, 0, 0.8)}
_ROUGH = {("thorax", "nose"): 0.07, ("nose", "head"): 0.07}


def sample_poses(count: int, seed: int = 0) -> np.ndarray:
    """joints (count, 17, 3) float32 metres, CAMERA axes, relative to the pelvis: bodies of standard proportions
    (pipeline/anthropometry.py) that squat, lean and swing arms and legs, seen from `wide` views, with 2 cm of noise
    and one joint in 50, never the torso's, NaN."""
    rng = np.random.default_rng(seed)
    bend = np.radians(rng.uniform(0, _SQUAT_DEG, count))
    forward, down = -np.sin(bend), -np.cos(bend)
    thigh = np.stack([forward, 0 * bend, down], axis=-1)
    below = {"knee": thigh, "ankle": thigh * [-1, 1, 1], "elbow": np.array([0, 0, -1.0])}
    below["wrist"] = np.array([-0.5, 0, -0.8])
    world = np.zeros((count, len(H36M17), 3))
    for parent, child in H36M17.bones:
        direction = np.asarray(_DIRECTION[child] if child in _DIRECTION else below[child[2:]], dtype=float)
        length = (SEGMENTS | _ROUGH)[(parent, child)] * _STATURE_M
        unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
        world[:, H36M17.index(child)] = world[:, H36M17.index(parent)] + length * unit
    world = swing(world, rng, 0.8)
    joints, _ = seen(world, views("wide", rng, count))
    joints = redefined(joints, rng, _NOISE_M) + _NOISE_M * rng.standard_normal(joints.shape)
    joints -= joints[:, [H36M17.index("pelvis")]]
    limbs = H36M17.indices(
        [f"{side}_{part}" for side in "lr" for part in ("knee", "ankle", "elbow", "wrist")]
    )
    lost = rng.uniform(size=(count, len(limbs))) < _MISSING
    joints[:, limbs] = np.where(lost[..., None], np.nan, joints[:, limbs])
    return joints.astype(np.float32)
