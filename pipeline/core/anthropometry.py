"""Segment lengths of an adult as fractions of stature, for the bones of H36M17.

Limbs and trunk: Drillis & Contini, Body Segment Parameters, New York University TR 1166.03, 1966, as redrawn in
Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, fig. 4.1. The trunk is the shoulder
joints' height, 0.818, less the hip joints', 0.530.

Widths: their figure gives breadths over the outside of the body, 0.191 at the hips and 0.259 at the shoulders;
joints lie further inside. The widths here are those between joint centres, the rounded medians of the subjects'
own skeletons (ASF files) in the CMU Graphics Lab Motion Capture Database: hips 0.09 to 0.11, shoulders 0.21 to
0.23. Estimators disagree about the widths more than about the limbs, so a scale is better taken from the limbs.

No bone of the neck or head is given: every estimator puts nose and head elsewhere (formats.md section 1).
"""

from __future__ import annotations

import numpy as np

from .layouts import FEET, H36M17, Layout
from .pose import PoseSequence
from .rotations import known_median, norm

STATURES_M = (0.4, 2.6)  # of people, from newborns on
ANKLE_HEIGHT = 0.039  # ankle joint above the sole
HIPS_WIDTH = 0.100
SHOULDERS_WIDTH = 0.220
TRUNK = 0.818 - 0.530  # from mid-hips to mid-shoulders

SEGMENTS: dict[tuple[str, str], float] = {
    ("pelvis", "spine"): TRUNK / 2,
    ("spine", "thorax"): TRUNK / 2,
    **{
        bone: length
        for side in ("r", "l")
        for bone, length in (
            (("pelvis", f"{side}_hip"), HIPS_WIDTH / 2),
            ((f"{side}_hip", f"{side}_knee"), 0.245),
            ((f"{side}_knee", f"{side}_ankle"), 0.246),
            (("thorax", f"{side}_shoulder"), SHOULDERS_WIDTH / 2),
            ((f"{side}_shoulder", f"{side}_elbow"), 0.186),
            ((f"{side}_elbow", f"{side}_wrist"), 0.146),
        )
    },
}

LIMBS = {
    bone: part for bone, part in SEGMENTS.items() if bone[1].endswith(("knee", "ankle", "elbow", "wrist"))
}


def implied_stature(joints: np.ndarray) -> float:
    """Stature, in the joints' unit, of a person with limbs like these: median lengths over the table's fractions.

    joints: (T, J, 3), H36M17 and maybe more behind. NaN when no limb bone is ever complete.
    """
    measured, fractions = 0.0, 0.0
    for (start, end), fraction in LIMBS.items():
        length = norm(joints[:, H36M17.index(end)] - joints[:, H36M17.index(start)])
        if np.isfinite(length).any():
            measured += float(np.nanmedian(length))
            fractions += fraction
    return measured / fractions if fractions else float("nan")


def floor_height(level: PoseSequence) -> float:
    """Height of the floor under a person, in LEVEL and the joints' unit: the median over frames of the lower sole, for
    in most frames one foot stands. From the pelvis, or from where `root` is counted. A sole is where heel and toes are
    where a source has them, and ANKLE_HEIGHT below the ankle else. NaN where neither is ever known."""
    soles = level.joints[:, level.layout.indices(("r_ankle", "l_ankle")), 2].astype(np.float64)
    soles -= ANKLE_HEIGHT * implied_stature(level.joints)
    feet = level.layout.indices([point for point in FEET.joints if point in level.layout])
    soles = np.concatenate([soles, level.joints[:, feet, 2]], axis=1)
    lowest = np.fmin.reduce(soles, axis=1) + (0.0 if level.root is None else level.root[:, 2])
    return known_median(lowest)


def trunk_length(joints: np.ndarray, layout: Layout) -> float:
    """Median distance of mid-hips and mid-shoulders of joints (T, J, D); NaN where it is never known."""
    pairs = [(f"l_{part}", f"r_{part}") for part in ("hip", "shoulder")]
    if not all(name in layout for pair in pairs for name in pair):
        return float("nan")
    hips, shoulders = (joints[:, layout.indices(pair)].astype(np.float64).mean(axis=1) for pair in pairs)
    return known_median(norm(shoulders - hips))
