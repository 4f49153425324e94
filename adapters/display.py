"""Poses that were turned for display, and the turning undone: D3DP's `test_3d_output_<video>_postprocess.npy`, and what
the vis.py family draws (formats.md 2.2, 2.4, 2.6).

The result looks like a world with z up, and is none. The pelvis is taken for the origin again, as these lifters have
it, and the rotation is inverted. Of (steps, proposals, frames, 17, 3) the last step and the mean of the proposals are
taken. The undoing has to be asked for, because another camera's orientation leaves no trace in the file by which it
could be told from this one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import H36M17
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import MadeBy, PoseSequence
from ..pipeline.core.rotations import rotate, transpose
from ..pipeline.files.arrays import load
from .kit.metric import FRAMES, check_metric, in_camera, looks_metric
from .kit.numpy import peek
from .kit.quaternions import rotations

name = "display"
gives = "poses"
made_by = MadeBy("estimated", "D3DP")
reads = "D3DP's *_postprocess.npy and others turned for display, with option undo, metres"

_ALL = ("steps", "proposals", *FRAMES)
_CAMERA_WXYZ = (0.1407056451, -0.1500701755, -0.7552407980, 0.6223280430)
_CLIP = 243  # of D3DP, the one that saves steps and proposals
_FLOOR_M = 1e-5
_STANDING_M = 0.2  # somebody's pelvis is higher above the lowest joint than that in half of the frames


def sniff(path: Path) -> bool:
    stored = peek(path, FRAMES, _ALL)
    if stored is None or not stored[..., 2].min() >= -_FLOOR_M:
        return False
    stored = load(path, FRAMES, _ALL)  # any row may be the one that touches the floor
    return _rebase(stored) is not None and looks_metric(_undone(stored))


def read(path: Path, undo: bool = False) -> tuple[PoseSequence]:
    """The one person of the file: H36M17 in camera axes, metres.

    undo: invert the display's rotation and heights. Without it the file is refused.
    Raises InputError when the file is no such array, or its heights do not begin at 0.
    """
    stored = load(path, FRAMES, _ALL)
    rebase = _rebase(stored)
    if rebase is None:
        raise InputError(
            "wrong-axes",
            f"{path}: expected poses turned for display, with the lowest joint at height 0 in the file or in each "
            "frame, got other heights; adapter videopose3d or ddhpose reads the raw output.",
        )
    if not undo:
        raise InputError(
            "wrong-axes",
            f"{path}: these poses were turned for display, with the orientation of one Human3.6M camera and the lowest "
            f"joint of {rebase} at height 0; give the raw output, or pass undo=true (--option undo=true) to undo both.",
        )
    poses = in_camera(_undone(stored), _CLIP if stored.ndim == len(_ALL) else None)
    check_metric(path, poses.joints)
    return (poses.noted("undo display", rebase=rebase).saying(notice("display-undone")),)


def _rebase(stored: np.ndarray) -> str | None:
    """What was lifted so that its lowest joint is at height 0: "the file", "each frame", or None for neither."""
    heights = stored[..., 2].astype(np.float64)
    if not np.isfinite(heights).all():
        return None
    lowest = heights.min(axis=-1)
    pelvis = heights[..., H36M17.index("pelvis")]
    if np.median(pelvis) < _STANDING_M or abs(lowest.min()) > _FLOOR_M:
        return None
    return "each frame" if (np.abs(lowest) <= _FLOOR_M).all() else "the file"


def _undone(stored: np.ndarray) -> np.ndarray:
    """(frames, 17, 3) in camera axes, pelvis at the origin."""
    displayed = (
        stored[-1].mean(axis=0, dtype=np.float64) if stored.ndim == len(_ALL) else stored.astype(np.float64)
    )
    R_display_from_camera = rotations(np.array([_CAMERA_WXYZ]))[0]
    pelvis = displayed[:, [H36M17.index("pelvis")]]
    return rotate(transpose(R_display_from_camera), displayed - pelvis)
