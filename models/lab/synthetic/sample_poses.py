"""Poses to measure a rectifier on where no motion capture is at hand: a standard body that moves its limbs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ....pipeline.core.anthropometry import SEGMENTS
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.rotations import rotate, unit
from .views import seen, views

_STATURE_M = 1.7
_NOISE_M = 0.02
_MISSING = 0.02
_SQUAT_DEG = 90.0  # thighs and, behind them, shins turn by up to this
# Directions of an upright body that faces -x, +Z up; the bones without a length of their own get a rough one.
_DIRECTION = {"r_hip": (0, 1, 0), "l_hip": (0, -1, 0), "r_shoulder": (0, 1, 0), "l_shoulder": (0, -1, 0)}
_DIRECTION |= {joint: (0, 0, 1) for joint in ("spine", "thorax", "head")} | {"nose": (-0.6, 0, 0.8)}
ABOVE_SPINE = ("thorax", "nose", "head", *(f"{s}_{p}" for s in "lr" for p in ("shoulder", "elbow", "wrist")))
_SWUNG = {"hip": (("knee", "ankle"), 10), "shoulder": (("elbow", "wrist"), 20)}  # what moves, and degrees
_ROUGH = {("thorax", "nose"): 0.07, ("nose", "head"): 0.07}


def sample_poses(count: int) -> np.ndarray:
    """joints (count, 17, 3) float32 metres, CAMERA axes, relative to the pelvis: bodies of standard proportions
    (pipeline/core/anthropometry.py) that squat, lean and swing arms and legs, seen from `wide` views, with 2 cm of
    noise and one joint in 50, never the torso's, NaN."""
    rng = np.random.default_rng(0)
    bend = np.radians(rng.uniform(0, _SQUAT_DEG, count))
    forward, down = -np.sin(bend), -np.cos(bend)
    thigh = np.stack([forward, 0 * bend, down], axis=-1)
    below = {"knee": thigh, "ankle": thigh * [-1, 1, 1], "elbow": np.array([0, 0, -1.0])}
    below["wrist"] = np.array([-0.5, 0, -0.8])
    world = np.zeros((count, len(H36M17), 3))
    for parent, child in H36M17.bones:
        direction = np.asarray(_DIRECTION[child] if child in _DIRECTION else below[child[2:]], dtype=float)
        length = (SEGMENTS | _ROUGH)[(parent, child)] * _STATURE_M
        world[:, H36M17.index(child)] = world[:, H36M17.index(parent)] + length * unit(direction)
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


def swing(joints_world: np.ndarray, rng: np.random.Generator, share: float) -> np.ndarray:
    """joints (B, 17, 3), +Z up, with a share of the bodies leaning further and swinging whole limbs further.

    The upper body turns about the spine by about 10 degrees, arms about the shoulders by 20, legs about the hips
    by 10; knees and elbows keep their angles, so no joint bends the wrong way.
    """
    from scipy.spatial.transform import Rotation

    out = joints_world.copy()
    use = (rng.uniform(size=len(out)) < share)[:, None]

    def turn(about: str, moved: Iterable[str], std_deg: float) -> None:
        vector = np.radians(std_deg) * rng.standard_normal((len(out), 3)).clip(-2, 2) * use
        R = Rotation.from_rotvec(vector).as_matrix()
        centre, rows = out[:, [H36M17.index(about)]], H36M17.indices(list(moved))
        out[:, rows] = centre + rotate(R, out[:, rows] - centre)

    turn("spine", ABOVE_SPINE, 10)
    for side in "lr":
        for part, (below, std_deg) in _SWUNG.items():
            turn(f"{side}_{part}", [f"{side}_{joint}" for joint in below], std_deg)
    return out.astype(joints_world.dtype)


def redefined(joints: np.ndarray, rng: np.random.Generator, std_m: float) -> np.ndarray:
    """joints (B, 17, 3) with spine, thorax, nose and head moved in the body's sagittal plane."""
    left = joints[:, H36M17.index("l_shoulder")] - joints[:, H36M17.index("r_shoulder")]
    trunk = unit(joints[:, H36M17.index("thorax")])
    front = unit(np.cross(left, trunk))
    plane = np.nan_to_num(np.stack([front, trunk], axis=-2))
    rows = H36M17.indices(("spine", "thorax", "nose", "head"))
    amounts = std_m * rng.standard_normal((len(joints), len(rows), 2)).clip(-2, 2)
    out = joints.copy()
    out[:, rows] += amounts @ plane
    return out
