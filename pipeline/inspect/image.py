"""Four frames of a skeleton from three sides, as a PNG."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.frames import Frame
from ..core.layouts import H36M17, Layout
from ..core.pose import PoseSequence
from ..core.rotations import rotate
from ..files.images import write_png
from ..signals.checks import whole_rows

_CELL, _HEADER = 260, 24  # pixels
_FRAMES = 4
# Right, up and away as one sees it, from the families' reference axes; in a world one looks north.
_SEEN = {"camera": ((1, 0, 0), (0, -1, 0), (0, 0, 1)), "world": ((0, -1, 0), (0, 0, 1), (1, 0, 0))}
_SIDES = {"front": (0, 1), "from the right": (2, 1), "from above": (0, 2)}  # what goes right, what goes up
_COLOURS = {"l_": (178, 114, 0), "r_": (0, 94, 213)}  # blue and orange, BGR
_MIDDLE = (110, 103, 96)


def from_the_front(points: np.ndarray, frame: Frame) -> np.ndarray:
    """(..., 2) to the right and down of points (..., 3) of a frame, as its camera sees them; in a world one looks
    north."""
    return _seen(points, frame)[..., :2] * [1, -1]


def bone_colour(start: str, end: str) -> tuple[int, int, int]:
    """BGR of a bone by its joints: of its side, or grey."""
    sides = {start[:2], end[:2]} & _COLOURS.keys()
    return _COLOURS[sides.pop()] if len(sides) == 1 else _MIDDLE


def draw_bones(image: np.ndarray, points: np.ndarray, layout: Layout, thick: int = 2, edge: int = 0) -> None:
    """A skeleton's bones at these pixels (J, 2), each in its colour, with a white edge so wide."""
    import cv2

    for start, end in layout.bones:
        ends = points[layout.indices((start, end))].round()
        if np.isfinite(ends).all():
            a, b = ends.astype(int).tolist()
            if edge:
                cv2.line(image, a, b, (255, 255, 255), thick + 2 * edge, cv2.LINE_AA)
            cv2.line(image, a, b, bone_colour(start, end), thick, cv2.LINE_AA)


def _seen(points: np.ndarray, frame: Frame) -> np.ndarray:
    """(..., 3) to the right, up and away."""
    return rotate(np.array(_SEEN[frame.family]) @ frame.basis.T, points)


def draw(poses: PoseSequence, path: Path) -> None:
    """Write the image. poses: H36M17 relative to the pelvis, in a camera's or world's axes.

    The frames are spread evenly over the complete ones; the scale is the same in all. InputError when the file cannot
    be written or is no .png, or no frame is complete.
    """
    import cv2

    if path.suffix.lower() != ".png":
        raise InputError("bad-value", f"Expected an image name that ends in .png, got {path}.")
    poses = poses.without_feet
    rows = np.flatnonzero(whole_rows(poses))
    if not len(rows):
        raise InputError("nothing-usable", "There is no complete frame that could be drawn.")
    rows = rows[np.linspace(0, len(rows) - 1, min(_FRAMES, len(rows))).round().astype(int)]
    points_seen = _seen(poses.joints[rows], poses.frame)
    reach = max(float(np.nanmax(np.abs(points_seen))), 1e-12)
    image = np.full((len(_SIDES) * _CELL + _HEADER, len(rows) * _CELL, 3), 255, dtype=np.uint8)
    for column, row in enumerate(rows):
        x = column * _CELL
        text = f"row {row}: left blue, right orange" if column == 0 else f"row {row}"
        cv2.putText(image, text, (x + 6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 1, cv2.LINE_AA)
        for line, (side, axes) in enumerate(_SIDES.items()):
            y = _HEADER + line * _CELL
            cv2.rectangle(image, (x, y), (x + _CELL - 1, y + _CELL - 1), (225, 225, 225), 1)
            cv2.putText(image, side, (x + 6, y + 16), cv2.FONT_HERSHEY_SIMPLEX, 0.42, _MIDDLE, 1, cv2.LINE_AA)
            middle = np.array([x, y]) + _CELL / 2
            points = middle + points_seen[column][:, axes] / reach * (_CELL / 2 - 18) * [1, -1]
            draw_bones(image, points, H36M17)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, image)
