"""Forward kinematics: joint angles, heading and pelvis become the 17 joints of a person who moves sagittally."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import SEGMENTS
from ...pipeline.core.layouts import H36M17

UP = np.array([0.0, 0.0, 1.0])

# In the head's own midplane, statures in front of and above the thorax.
_NOSE = (0.055, 0.100)
_HEAD_TOP = (0.000, 0.182)


def skeleton(
    angles_deg: dict[str, np.ndarray], heading_deg: np.ndarray, root: np.ndarray, stature_m: float
) -> np.ndarray:
    """(T, 17, 3) joints, H36M17, metres, in a Z-up world.

    angles_deg: (T,) by name, as examples.walker.walk.Walk describes them. heading_deg: (T,) where the person faces,
    0 along +x, positive towards +y. root: (T, 3) the pelvis.
    """
    facing = horizontal(heading_deg)
    hips = horizontal(heading_deg + 90 + angles_deg["pelvis_turn_deg"])  # from right to left
    shoulders = horizontal(heading_deg + 90 - angles_deg["pelvis_turn_deg"])
    lean = angles_deg["trunk_lean_deg"]
    points = {"pelvis": root}

    def grow(start: str, end: str, direction: np.ndarray) -> None:
        points[end] = points[start] + SEGMENTS[start, end] * stature_m * direction

    grow("pelvis", "spine", -hanging(-lean, facing))
    grow("spine", "thorax", -hanging(-lean, facing))
    for joint, place in (("nose", _NOSE), ("head", _HEAD_TOP)):
        points[joint] = points["thorax"] + stature_m * on_head(*place, angles_deg["head_lean_deg"], facing)
    for side, sign in (("l", 1), ("r", -1)):
        thigh = angles_deg[f"{side}_thigh_trunk_flexion_deg"] - lean
        shank = thigh - angles_deg[f"{side}_knee_flexion_deg"]
        upper_arm = angles_deg[f"{side}_shoulder_flexion_deg"] - lean
        forearm = upper_arm + angles_deg[f"{side}_elbow_flexion_deg"]
        grow("pelvis", f"{side}_hip", sign * hips)
        grow(f"{side}_hip", f"{side}_knee", hanging(thigh, facing))
        grow(f"{side}_knee", f"{side}_ankle", hanging(shank, facing))
        grow("thorax", f"{side}_shoulder", sign * shoulders)
        grow(f"{side}_shoulder", f"{side}_elbow", hanging(upper_arm, facing))
        grow(f"{side}_elbow", f"{side}_wrist", hanging(forearm, facing))
    return np.stack([points[joint] for joint in H36M17.joints], axis=1)


def horizontal(heading_deg: np.ndarray) -> np.ndarray:
    """(T, 3) unit vectors of a heading (T,): 0 is +x, 90 is +y."""
    heading = np.radians(heading_deg)
    return np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=-1)


def hanging(angle_deg: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """(T, 3) unit vectors that hang straight down, swung forward by an angle (T,)."""
    angle = np.radians(angle_deg)[:, None]
    return np.sin(angle) * facing - np.cos(angle) * UP


def on_head(forward: float, above: float, lean_deg: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """(T, 3) from the thorax to a point of the head's midplane, in the unit of `forward` and `above`."""
    return forward * hanging(90 - lean_deg, facing) - above * hanging(-lean_deg, facing)
