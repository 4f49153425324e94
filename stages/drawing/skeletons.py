"""Skeletons drawn as lines of a page, from one side or several, and the rows of a take that are worth drawing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from ...pipeline.core.layouts import Layout
from ...pipeline.core.rotations import is_finite
from . import palette
from .charts import MIDDLE
from .page import kit


def key_rows(joints: np.ndarray, count: int = 6) -> list[int]:
    """Rows that show what happens in a take: of each of `count` equal parts the one whose posture is farther from the
    take's median posture than nine in ten of that part, so that neither rest nor an outlier is shown. joints: (T, J, 3)
    in BODY, any unit."""
    visible = np.flatnonzero(is_finite(joints).mean(axis=1) > 0.5)
    if not len(visible):
        return []
    present = np.flatnonzero(is_finite(joints).any(axis=0))
    joints = joints if len(present) == joints.shape[1] else joints[:, present]
    usual = np.nanmedian(joints[visible], axis=0)
    rows = []
    for part in np.array_split(visible, min(count, len(visible))):
        off = np.nanmean(np.linalg.norm(joints[part] - usual, axis=-1), axis=-1)
        rows.append(int(part[np.argsort(off)[int(0.9 * (len(part) - 1))]]))
    return rows


def skeletons(views: Mapping[str, np.ndarray], layout: Layout, alt: str) -> Markup:
    """One skeleton from several sides at one scale. views: (J, 2) points to the right and up, by name."""
    visible = [points[is_finite(points)] for points in views.values()]
    wide = 200 if len(views) == 1 else 120
    field = np.array([wide - 8.0, 174.0])
    scale = min((field / np.maximum(np.ptp(points, axis=0), 1e-9)).min() for points in visible if len(points))
    lines: dict[str, str] = {}
    for i, points in enumerate(views.values()):
        middle = (np.nanmin(points, axis=0) + np.nanmax(points, axis=0)) / 2
        at = (points - middle) * (scale, -scale) + (wide * (i + 0.5), 108)
        for bone in layout.bones:
            ends = at[layout.indices(bone)]
            if is_finite(ends).all():
                side = palette.side_colour(*bone)
                colour = MIDDLE if side == palette.MIDDLE else palette.as_hex(side)
                bone_line = "M{:.1f} {:.1f}L{:.1f} {:.1f}".format(*ends.ravel())
                lines[colour] = lines.get(colour, "") + bone_line
    names = [(f"{wide * (i + 0.5):g}", name) for i, name in enumerate(views)]
    return kit("chart.html.j2").skeletons(names, lines, wide * len(views), alt)


def body_views(joints: np.ndarray) -> dict[str, np.ndarray]:
    """(..., 2) to the right and up by name of the view, of joints (..., 3) in BODY: back, right, up. From the front the
    person's right is on the left; from the right the face looks right."""
    return {"from the front": joints[..., [1, 2]] * (-1, 1), "from the right": joints[..., [0, 2]] * (-1, 1)}
