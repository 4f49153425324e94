"""What the page's player holds: the skeleton on its floor, frame by frame (stages/drawing/player.js)."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.layouts import with_feet
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ..drawing.facts import length_unit
from ..drawing.page import player
from ..drawing.palette import as_hex, side_colour

_MOST = 2500  # frames: a third of a megabyte
_STEPS, _MISSING = 32000, -32768
_SQUARES = 3.5  # of the floor's grid, as high as the person
_LOWEST = 2  # per cent of the frames in which a foot may be under the floor


def skeleton_player(take: Take) -> Markup:
    """HTML of the skeleton that plays; nothing of a take that could not be levelled, or of a single frame."""
    rectified = take.need("rectified")
    level = take.filtered if take.filtered is not None else rectified.level
    shown = np.flatnonzero(is_finite(level.joints).any(axis=1))
    if not rectified.level_ok or len(shown) < 2:
        return Markup("")
    rows = np.arange(shown[0], shown[-1] + 1, -(-(shown[-1] + 1 - shown[0]) // _MOST))
    drawn = with_feet(level)
    points, on_floor = _standing(drawn, rows)
    seen = points[is_finite(points)]
    if not len(seen):
        return Markup("")
    height = float(np.nanpercentile(points[..., 2].max(axis=1, where=is_finite(points), initial=0), 90))
    step = float(np.abs(seen).max()) / _STEPS
    whole = np.where(is_finite(points)[..., None], np.nan_to_num(np.round(points / step)), _MISSING).astype(
        "<i2"
    )
    layout, unit = drawn.layout, length_unit(level)
    square = 0.5 if unit == "m" else height / _SQUARES
    held: dict[str, Any] = {
        "times": np.round(level.times[rows], 4).tolist(),
        "joints": points.shape[1],
        "pelvis": layout.index("pelvis"),
        "step": step,
        "height": height,
        "square": square,
        "middle": np.nan_to_num(np.nanmedian(points[:, layout.index("pelvis")], axis=0)).tolist(),
        "bones": [[*layout.indices(bone), as_hex(side_colour(*bone))] for bone in layout.bones],
        "points": b64encode(whole.tobytes()).decode("ascii"),
    }
    squares = f" The squares are {square:g} m wide." if unit == "m" else ""
    caption = (
        f"The skeleton turned upright, on the floor.{squares} {on_floor} "
        "Drag to turn it; the slider moves the cursor of every chart of time."
    )
    return player(
        held, len(rows), "The take", "The skeleton on its floor; arrow keys turn it, space plays", caption
    )


def _standing(level: PoseSequence, rows: np.ndarray) -> tuple[np.ndarray, str]:
    """(N, J, 3) the joints of these rows with the floor at height 0, and how the floor was found, in words."""
    joints = level.joints[rows].astype(np.float64)
    feet = [
        i for i, name in enumerate(level.layout.joints) if "ankle" in name or "toe" in name or "heel" in name
    ]
    if level.root is None or not is_finite(level.root[rows]).any():
        lowest = joints[:, feet, 2].min(axis=1, where=is_finite(joints[:, feet]), initial=np.inf)
        seen = np.isfinite(lowest)
        lowest = np.where(seen, lowest, np.median(lowest[seen]) if seen.any() else 0.0)
        return joints - lowest[:, None, None] * (
            0,
            0,
            1,
        ), "The person's place is not known, so the lower foot is put on the floor."
    joints = joints + level.root[rows][:, None]
    lowest = joints[:, feet, 2]
    floor = (
        float(np.nanpercentile(lowest, _LOWEST))
        if np.isfinite(lowest).any()
        else float(np.nanmin(joints[..., 2]))
    )
    return joints - (0, 0, floor), "The floor is at the lowest height of the feet."
