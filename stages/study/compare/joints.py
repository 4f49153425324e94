"""How far the joints of two sides are apart, each joint for itself."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ....models.common.metrics import person_size
from ....pipeline.core.layouts import H36M17
from ...drawing.page import Cell, small, table
from ...drawing.words import spoken

_FEWEST = 10  # frames

JointAgreement = dict[str, dict[str, float | int]]


def joint_agreement(joints: np.ndarray, reference: np.ndarray, metric: bool) -> JointAgreement:
    """By joint the distance of joints (T, 17, 3) from others (T, 17, 3), both about the pelvis in one LEVEL, of one
    size: its median, root mean square and 95th percentile in per cent of the reference's size (the root mean square
    distance of its joints from the pelvis), and, of metres, the root mean square in mm. Joints that fewer than ten
    frames have are left out, and the pelvis.
    """
    size = person_size(reference)
    apart = np.linalg.norm(joints - reference, axis=-1)
    found: JointAgreement = {}
    for row, joint in enumerate(H36M17.joints):
        off = apart[np.isfinite(apart[:, row]), row]
        if joint == "pelvis" or len(off) < _FEWEST:
            continue
        rms = float(np.sqrt((off**2).mean()))
        found[joint] = {
            "frames": len(off),
            "p50_percent": 100 * float(np.median(off)) / size,
            "rms_percent": 100 * rms / size,
            "p95_percent": 100 * float(np.quantile(off, 0.95)) / size,
            **({"rms_mm": 1000 * rms} if metric else {}),
        }
    return found


def joint_table(found: JointAgreement, truth: bool) -> Markup:
    """HTML of a `joint_agreement`; nothing without joints. truth: whether the reference is motion capture."""
    if not found:
        return Markup("")
    named = {
        "p50_percent": "median (%)", "rms_percent": "root mean square (%)", "p95_percent": "95 % of frames below (%)",
        "rms_mm": "root mean square (mm)",
    }  # fmt: skip
    keys = [key for key in named if all(key in of for of in found.values())]
    rows: list[list[Cell]] = [[spoken(joint), *(of[key] for key in keys)] for joint, of in found.items()]
    head = ("joint", *(named[key] for key in keys))
    words = (
        "Distance in one LEVEL and at one size, from the pelvis, in per cent of the person's size (root mean square "
        "distance of the joints from the pelvis)."
    )
    return small(words if truth else f"{words} {LOWER_BOUND}") + table(head, rows)


LOWER_BOUND = (
    "Half of a root mean square difference is a lower bound of the error of one of the two, here as for angles: runs "
    "that agree may still err alike."
)
