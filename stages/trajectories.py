"""Paths and velocities of wrists and ankles in LEVEL, relative to the pelvis."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np

from ..pipeline.errors import InputError
from ..pipeline.pose import PoseSequence
from ..pipeline.rotations import known
from ..pipeline.take import Take

_SUFFIXES = {"m": ("m", "mps"), "arbitrary": ("au", "aups")}


@dataclass(frozen=True)
class Trajectories:
    """The stage. joints: whose paths to write."""

    joints: tuple[str, ...] = ("r_wrist", "l_wrist", "r_ankle", "l_ankle")

    name: ClassVar[str] = "trajectories"
    needs: ClassVar[tuple[str, ...]] = ("rectified",)
    gives: ClassVar[tuple[str, ...]] = ("kinematics",)

    def __call__(self, take: Take) -> Take:
        assert take.rectified is not None
        columns = dict(take.kinematics or {})
        for joint in self.joints:
            columns |= trajectory(take.rectified.level, joint)
        return take.with_(kinematics=columns)


def trajectory(level: PoseSequence, joint: str) -> dict[str, np.ndarray]:
    """Columns (T,) `<joint>_x_m` ... `<joint>_vx_mps` ... `<joint>_speed_mps`, or `_au`, `_aups` without a scale.

    Velocity is the central difference of the unfiltered path, never across a gap, a seam or dropped
    frames; NaN where it cannot be had.
    """
    if level.frame.unit not in _SUFFIXES:
        raise InputError(f"Expected poses in metres or in arbitrary units, got {level.frame.unit}.")
    length, speed = _SUFFIXES[level.frame.unit]
    path = level.joint(joint).astype(np.float64)
    step = np.diff(level.frame_index)
    jumps = np.flatnonzero(step > np.median(step)) + 1 if len(step) else np.zeros(0, dtype=int)
    velocity = derivative(path, level.times, (*level.seams, *jumps.tolist()))
    columns = {f"{joint}_{axis}_{length}": path[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"{joint}_v{axis}_{speed}": velocity[:, i] for i, axis in enumerate("xyz")}
    columns[f"{joint}_speed_{speed}"] = np.linalg.norm(velocity, axis=-1)
    return columns


def derivative(path: np.ndarray, time_s: np.ndarray, seams: tuple[int, ...] = ()) -> np.ndarray:
    """d path / dt, (T, D) per second: second-order differences inside each unbroken run of at least 3 rows."""
    result = np.full(path.shape, np.nan)
    seen = known(path)
    breaks = np.flatnonzero(np.diff(seen.astype(int))) + 1
    edges = [0, *sorted({*breaks.tolist(), *seams}), len(path)]
    for start, stop in pairwise(edges):
        if seen[start] and stop - start >= 3:
            result[start:stop] = np.gradient(path[start:stop], time_s[start:stop], axis=0, edge_order=2)
    return result
