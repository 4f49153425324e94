"""Angles of ankle and foot, where the source gives heels and toes: conventions and values.

The foot's line runs from the heel to the middle of big and small toe, or to the big toe where the source never gives a
small one. BlazePose's foot index, the tip of the foot's middle, stands for the big toe.

- Ankle dorsiflexion follows the ISB's ankle (Wu et al., J Biomech 35, 2002) in sign and plane as far as a line can: the
  angle in the plane of shank and foot, without the rotation of the foot about itself. It is 0 where the foot's line is
  square to the shank. Heel and toes lie at other heights with every estimator, which shifts it by a constant of some
  degrees: compare changes.
- Foot progression is taken against where the person faces (BODY), not against the path, which most sources do not know.
  For somebody who walks the way they face it is the clinical angle, toe-out positive.
"""

from __future__ import annotations

import numpy as np

from ..core.layouts import Layout
from ..core.limits import limit
from ..core.rotations import unit
from .angles import ANGLES, defined, of_both

_FACING = ("r_hip", "l_hip", "r_shoulder", "l_shoulder")
FOOT_ANGLES = defined("feet")
ALL_ANGLES = ANGLES | FOOT_ANGLES
ALL_OF_BOTH = tuple(dict.fromkeys(map(of_both, ALL_ANGLES)))  # names without sides


def has_foot_angles(layout: Layout) -> bool:
    """Whether it has the points that every angle of the feet needs."""
    return all(f"{side}_{point}" in layout for side in "rl" for point in ("heel", "big_toe"))


def foot_angles(body: np.ndarray, layout: Layout) -> dict[str, np.ndarray]:
    """(T,) degrees by name of FOOT_ANGLES. body: (T, J, 3) in BODY. layout: one with `has_foot_angles`.

    NaN where a point is missing, and the progression of a foot that stands upright. Where only the ankles matter they
    may be in any axes.
    """
    at = dict(zip(layout.joints, np.moveaxis(body.astype(np.float64), -2, 0), strict=True))
    facing = np.isfinite(sum(at[joint] for joint in _FACING)).all(axis=-1)
    degrees, least = {}, np.sin(np.radians(limit("angles.foot-flat")))
    for side, out in (("r", 1.0), ("l", -1.0)):
        shank = unit(at[f"{side}_knee"] - at[f"{side}_ankle"])
        big = at[f"{side}_big_toe"]
        toes = (big + at.get(f"{side}_small_toe", big)) / 2
        foot = unit(toes - at[f"{side}_heel"])
        # The sine of 90 degrees less the angle between the two is their cosine.
        between = np.einsum("...i,...i->...", shank, foot)
        degrees[f"{side}_ankle_dorsiflexion"] = np.degrees(np.arcsin(np.clip(between, -1.0, 1.0)))
        flat = np.hypot(foot[..., 0], foot[..., 1]) > least
        turned = np.degrees(np.arctan2(out * foot[..., 1], -foot[..., 0]))
        degrees[f"{side}_foot_progression"] = np.where(facing & flat, turned, np.nan)
    return degrees
