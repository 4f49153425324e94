"""Whether joints are in the order that is said, by the lengths of limbs and trunk: in another they join others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..core.anthropometry import SEGMENTS, TRUNK
from ..core.errors import InputError
from ..core.layouts import H36M17_B, H36M17_C, LAYOUTS, Layout
from ..core.limits import limit
from ..core.rotations import is_finite

# Bones of one side, and their lengths as shares of the stature.
_BONES = {
    ("hip", "knee"): SEGMENTS["l_hip", "l_knee"],
    ("knee", "ankle"): SEGMENTS["l_knee", "l_ankle"],
    ("shoulder", "elbow"): SEGMENTS["l_shoulder", "l_elbow"],
    ("elbow", "wrist"): SEGMENTS["l_elbow", "l_wrist"],
    ("shoulder", "hip"): TRUNK,
}
MISFIT = limit("joint-order.misfit")
_MOST_ROWS = 5000  # that are looked at


def misfit(points: np.ndarray, layout: Layout) -> float:
    """How far the lengths of ten bones are from a person's, as the mean absolute logarithm of their ratio, whatever the
    scale: 0.1 is 10 %. points: (N, J, 2 or 3), NaN where missing. NaN where too few bones are seen."""
    logs = []
    for (start, end), share in _BONES.items():
        for side in "lr":
            ends = points[:, layout.indices((f"{side}_{start}", f"{side}_{end}"))]
            length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=-1)
            length = length[np.isfinite(length)]
            if len(length):
                across = float(np.percentile(length, limit("joint-order.across")))
                logs.append(np.log(max(across, 1e-9) / share))
    return float(np.mean(np.abs(logs - np.median(logs)))) if len(logs) > len(_BONES) else float("nan")


def likely_layout(points: np.ndarray, layouts: Sequence[Layout]) -> Layout:
    """The first of layouts of as many joints, unless the bones of bodies (N, J, 2 or 3) are those of a person in
    another of them only."""
    return other_order(points, layouts[0], layouts[1:]) or layouts[0]


def check_order(points: np.ndarray, layout: Layout, where: str, way_out: str) -> None:
    """InputError where the limbs of points (N, J, 2 or 3) are those of a body in another public order only; H36M17's
    mirror images, of the same bones, are none. where: begins the sentence. way_out: how to have them read in that
    order, with "{}" in place of its name."""
    others = (each for each in LAYOUTS.values() if each not in (H36M17_B, H36M17_C))
    if (fits := other_order(points, layout, others, limit("joint-order.rows"))) is not None:
        raise InputError(
            "wrong-content",
            f"{where}expected joints in the order of {layout.name}, but their limbs are those of a body in the order "
            f"of {fits.name} only; if they are in that order, say so with {way_out.format(fits.name)}.",
        )


def other_order(
    points: np.ndarray, layout: Layout, others: Iterable[Layout], fewest: int = 1
) -> Layout | None:
    """The other layout in which points (N, J, 2 or 3) have the bones of a person, where they have not in their own;
    None where nothing is wrong, where none of the others fits, and where less than `fewest` rows are there: in a few a
    bone may point at the camera throughout."""
    rivals = [other for other in others if len(other) == len(layout) and other != layout]
    bodies = points[is_finite(points).any(axis=1)] if rivals else points[:0]
    if len(bodies) < fewest or not len(bodies):
        return None
    bodies = bodies[:: 1 + len(bodies) // _MOST_ROWS]
    own = misfit(bodies, layout)
    misfits = [np.nan_to_num(misfit(bodies, other), nan=np.inf) for other in rivals]
    best = int(np.argmin(misfits))
    return rivals[best] if own > MISFIT and misfits[best] < limit("joint-order.half") * own else None
