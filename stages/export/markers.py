"""The 17 joints, and heels and toes where the source has them, as a motion laboratory's markers: metres, one even rate,
the person's own path where it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...pipeline.errors import InputError
from ...pipeline.frames import LEVEL, Frame
from ...pipeline.layouts import with_feet
from ...pipeline.motion.signals import breaks, evenly_spaced, rate, resample
from ...pipeline.rotations import rotate
from ...pipeline.take import Take

OPENSIM = Frame("OPENSIM", "level", ("front", "up", "right"))  # the axes of OpenSim's models


@dataclass(frozen=True, eq=False)
class Markers:
    """joints: (N, M, 3) metres, NaN where missing. names: (M,). time_s: (N,) evenly spaced at fps."""

    joints: np.ndarray
    names: tuple[str, ...]
    time_s: np.ndarray
    fps: float


def markers(take: Take, frame: Frame) -> Markers:
    """The take's filtered joints in the axes of a frame of LEVEL's family.

    The pelvis is the origin, or moves along the path that the source gives it, from the camera or the world's origin
    (root of PoseSequence). These files know no time stamps but a rate: a take whose stamps are not evenly spaced is
    brought to its usual rate by cubic splines. InputError for a take without a scale or without a filtered skeleton.
    """
    path = take.filtered and with_feet(take.filtered)
    if path is None:
        raise InputError(
            "TRC and C3D hold the filtered joints; put the stage 'trajectories' before 'export'."
        )
    if path.frame.unit != "m":
        raise InputError(
            "TRC and C3D hold metres, and the source has no scale; give the person's height (--stature METRES)."
        )
    joints = path.joints.astype(np.float64)
    if path.root is not None:
        joints = joints + path.root[:, None]
    time_s, fps = path.times, rate(path.times)
    if not evenly_spaced(time_s, fps):
        grid = np.arange(time_s[0], time_s[-1] + 1e-9, 1 / fps)
        each = [resample(joints[:, i], time_s, grid, breaks(path)) for i in range(joints.shape[1])]
        joints, time_s = np.stack(each, axis=1), grid
    return Markers(rotate(frame.basis @ LEVEL.basis.T, joints), path.layout.joints, time_s, fps)
