"""What an adapter read, in our joints and axes, relative to the pelvis."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from ..core.frames import CAMERA, change_frame
from ..core.layouts import body_in, remap
from ..core.messages import how_many
from ..core.notices import notice
from ..core.pose import PoseSequence
from ..core.take import Told
from ..signals.checks import empty_rows, whole_rows
from .bounds import check_size, timed
from .guard import guarded


def normalised(poses: PoseSequence, where: str, fps: float | None, told: Told) -> PoseSequence:
    """What was read, as read_all gives it: 2D as it is; 3D remapped, relative to the pelvis, guarded. where: what it
    comes from, for errors. told: its handedness and check count. Raises InputError."""
    if fps is not None:
        poses = timed(poses, fps)
    check_size(poses, where)
    if poses.frame.dims == 2:
        return poses
    poses = _missing(poses, where)
    poses = remap(poses, body_in(poses))
    own = CAMERA if poses.frame.family == "camera" else poses.frame
    poses = change_frame(
        poses, own.with_(origin="pelvis", unit="m" if poses.frame.metric else poses.frame.unit)
    )
    return guarded(poses, told.handedness, where, told.check)


def _missing(poses: PoseSequence, where: str) -> PoseSequence:
    """Frames with NaN, and those of zeros as gaps, counted. InputError where no frame has a pose."""
    empty = empty_rows(poses)
    gone = ~whole_rows(poses) & ~empty
    if empty.all():
        raise InputError(
            "nothing-usable",
            f"{where}: in each frame all joints are at one point ({how_many(len(poses), 'frame')}); there are no "
            "poses in it.",
        )
    if np.isnan(poses.joints).all():
        raise InputError("nothing-usable", f"{where}: every coordinate is NaN; there are no poses in it.")
    if not (empty | gone).any():
        return poses
    counts = {"frames with NaN": int(gone.sum()), "frames with all joints at one point": int(empty.sum())}
    counted = ", ".join(
        how_many(count, what.replace("frames", "frame", 1), what) for what, count in counts.items() if count
    )
    poses = poses.with_(joints=np.where(empty[:, None, None], np.nan, poses.joints))
    return poses.noted("missing", **counts).saying(notice("frames-as-gaps", counts=counted))
