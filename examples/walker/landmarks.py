"""The 26 points of the Halpe layout on the walker: the joints, and plausible points of the face and the feet."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.anthropometry import ANKLE_HEIGHT
from ...pipeline.core.layouts import HALPE26
from .skeleton import hanging, horizontal, on_head
from .walk import Walk

# Statures: in front of, above and to the side of the thorax, in the head's own axes.
_FACE = {"eye": (0.048, 0.118, 0.018), "ear": (0.005, 0.110, 0.042)}
# Statures: in front of and outwards of the ankle, on the sole.
_FOOT = {"big_toe": (0.105, -0.008), "small_toe": (0.085, 0.028), "heel": (-0.035, 0.000)}
_SAME = {"head_top": "head", "neck": "thorax"}  # Halpe's name: the skeleton's


def halpe26(walk: Walk) -> np.ndarray:
    """(T, 26, 3) metres in the world, HALPE26; a point of the foot that would dip into the floor lies on it."""
    facing = horizontal(walk.heading_deg)
    left = horizontal(walk.heading_deg + 90)
    points = {}
    for side, outwards in (("l", left), ("r", -left)):
        for part, (forward, above, aside) in _FACE.items():
            offset = on_head(forward, above, walk.angles_deg["head_lean_deg"], facing) + aside * outwards
            points[f"{side}_{part}"] = walk.joint("thorax") + walk.stature_m * offset
        pitch = walk.angles_deg[f"{side}_foot_pitch_deg"]
        for part, (forward, aside) in _FOOT.items():
            sole = forward * hanging(90 + pitch, facing) + ANKLE_HEIGHT * hanging(pitch, facing)
            point = walk.joint(f"{side}_ankle") + walk.stature_m * (sole + aside * outwards)
            points[f"{side}_{part}"] = np.maximum(point, [-np.inf, -np.inf, 0.0])
    return np.stack(
        [points[name] if name in points else walk.joint(_SAME.get(name, name)) for name in HALPE26.joints],
        axis=1,
    )
