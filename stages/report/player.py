"""What the page's player holds: the skeleton on its floor, frame by frame, and the video's pictures of the person
(stages/drawing/player.js)."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ..drawing.page import player
from ..drawing.palette import as_hex, side_colour
from .film import film

_MOST = 2500  # frames: a third of a megabyte
_STEPS, _MISSING = 32000, -32768
_SQUARES = 3.5  # of the floor's grid, as high as the person


def skeleton_player(take: Take) -> Markup:
    """HTML of the skeleton that plays, beside the video's pictures where there are such; empty of a take without a
    rotation in any frame, or of a single frame. InputError when the video cannot be decoded."""
    rectified = take.need("rectified")
    level = take.filtered if take.filtered is not None else rectified.level
    shown = np.flatnonzero(is_finite(level.without_feet.joints).any(axis=1))
    if len(shown) < 2:
        return Markup("")
    rows = np.arange(shown[0], shown[-1] + 1, -(-(shown[-1] + 1 - shown[0]) // _MOST))
    points, on_floor = _standing(level, rows)
    known_points = points[is_finite(points)]
    if not len(known_points):
        return Markup("")
    height = float(np.nanpercentile(points[..., 2].max(axis=1, where=is_finite(points), initial=0), 90))
    step = float(np.abs(known_points).max()) / _STEPS
    whole = np.where(is_finite(points)[..., None], np.nan_to_num(np.round(points / step)), _MISSING).astype(
        "<i2"
    )
    layout, metric = level.layout, level.frame.unit == "m"
    square = 0.5 if metric else height / _SQUARES
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
    pictures = film(take, shown)
    held |= {"film": pictures} if pictures else {}
    what = "The video, and beside it the skeleton" if pictures else "The skeleton"
    squares = f" The squares are {square:g} m wide." if metric else ""
    how = "as it came, not levelled."
    if rectified.level_ok:
        how = f"turned upright, on the floor.{squares} {on_floor}"
    caption = (
        f"{what} {how} Orange is the person's right, blue the left. Drag to turn it; the slider moves the cursor of "
        "every chart of time."
    )
    words = "The skeleton on its floor; arrow keys turn it, space plays"
    return player(held, len(rows), words, caption, "The video at the same moment" if pictures else "")


def _standing(level: PoseSequence, rows: np.ndarray) -> tuple[np.ndarray, str]:
    """(N, J, 3) the joints of these rows with the floor at height 0, and how the floor was found, in words."""
    joints = level.joints[rows].astype(np.float64)
    feet = [
        i for i, name in enumerate(level.layout.joints) if "ankle" in name or "toe" in name or "heel" in name
    ]
    if level.root is None or not is_finite(level.root[rows]).any():
        lowest = joints[:, feet, 2].min(axis=1, where=is_finite(joints[:, feet]), initial=np.inf)
        has_foot = np.isfinite(lowest)
        usual = np.median(lowest[has_foot]) if has_foot.any() else 0.0
        joints[..., 2] -= np.where(has_foot, lowest, usual)[:, None]
        return joints, "The person's place is not known, so the lower foot is put on the floor."
    joints += level.root[rows][:, None]
    floor = floor_height(level)
    joints[..., 2] -= floor if np.isfinite(floor) else np.nanmin(joints[..., 2])
    return joints, "The floor is where the feet stand in most frames."
