"""What an adapter read, in our joints and axes, relative to the pelvis."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from ..core.errors import InputError
from ..core.frames import CAMERA, change_frame
from ..core.layouts import H36M17, remap
from ..core.messages import how_many
from ..core.notices import notice
from ..core.pose import PoseSequence, Step, package_version
from ..core.take import Handedness
from ..files.atomic import printable
from ..plugins.protocols import Adapter
from ..signals.bounds import check_size
from ..signals.checks import empty_rows, whole_rows
from ..signals.rates import timed
from .handedness import guarded

Missing = Literal["refuse", "gap"]


def normalised(
    poses: PoseSequence,
    adapter: Adapter,
    path: Path,
    fps: float | None,
    handedness: Handedness,
    missing: Missing,
) -> PoseSequence:
    """What an adapter read, as read_all gives it: remapped, relative to the pelvis, guarded. Raises InputError."""
    options = {"adapter": adapter.name, "file": printable(path.name), "person": poses.person}
    poses = poses.with_(history=(Step("read", package_version(), options), *poses.history))
    if fps is not None:
        poses = timed(poses, fps)
    check_size(poses, str(path))
    if adapter.gives == "keypoints":
        return poses
    poses = remap(_missing(poses, path, missing), H36M17)
    own = CAMERA if poses.frame.family == "camera" else poses.frame
    poses = change_frame(
        poses, own.with_(origin="pelvis", unit="m" if poses.frame.metric else poses.frame.unit)
    )
    return guarded(poses, handedness, f"{path} (adapter {adapter.name})")


def _in_words(what: str, count: int) -> str:
    """Such as "2 frames with NaN"."""
    return how_many(count, what.replace("frames", "frame", 1), what)


def _missing(poses: PoseSequence, path: Path, missing: Missing) -> PoseSequence:
    empty = empty_rows(poses)
    gone = ~whole_rows(poses) & ~empty
    if empty.all():
        raise InputError(
            "nothing-usable",
            f"{path}: in each frame all joints are at one point ({how_many(len(poses), 'frame')}); there are no "
            "poses in it.",
        )
    if np.isnan(poses.joints).all():
        raise InputError("nothing-usable", f"{path}: every coordinate is NaN; there are no poses in it.")
    if not (empty | gone).any():
        return poses
    counts = {"frames with NaN": int(gone.sum()), "frames with all joints at one point": int(empty.sum())}
    if missing == "refuse":
        first = int(np.argmax(empty | gone))
        said = " and ".join(_in_words(what, count) for what, count in counts.items() if count)
        raise InputError(
            "wrong-content",
            f"{path}: expected a pose in each of {how_many(len(poses), 'frame')}, got {said} (first at row {first}); "
            "pass --set read.missing=gap to treat them as gaps.",
        )
    words = ", ".join(_in_words(what, count) for what, count in counts.items() if count)
    poses = poses.mapped(lambda points: np.where(empty[:, None, None], np.nan, points))
    return poses.noted("missing", **counts).saying(notice("gaps-as-asked", counts=words))
