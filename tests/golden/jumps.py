"""A person who jumps with stiff legs: a known fall."""

import numpy as np

from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, LEVEL, PoseSequence

STATURE_M = 1.7
HIGH_M = 0.35


def standing() -> np.ndarray:
    """(17, 3) metres, the pelvis as origin, z up."""
    walk = walker(seconds=1.0, stature_m=STATURE_M)
    return walk.world[0] - walk.root[0]


def jumping(slowed: float = 1.0, fps: float = 30.0, noise_m: float = 0.0) -> PoseSequence:
    """Two jumps in LEVEL with `root`: the pelvis stands at 0.9 m, flies 0.35 m high and stands again."""
    time_s = np.arange(0, 5 * slowed, 1 / fps)
    real = time_s / slowed
    z = 0.9 + sum(np.maximum(0.0, HIGH_M - 9.81 / 2 * (real - at) ** 2) for at in (1.5, 3.3))
    root = np.stack([0.3 * real, np.zeros_like(z), z], axis=-1)
    joints = np.repeat(standing()[None], len(z), axis=0)
    joints = joints + np.random.default_rng(3).normal(0, noise_m, joints.shape)
    return PoseSequence(joints, H36M17, LEVEL, time_s=time_s, root=root)
