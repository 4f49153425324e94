"""The gait of a take's motion, its walks, and how far the legs come apart in its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.core.rotations import transpose
from ...pipeline.signals.filters import runs
from ..common.motion import Motion
from .events import Step
from .fading import along_sight, faded_steps
from .gait import LEAST_STEP, Gait, facing_deg, find_gait, separation

SIDES = {"right": "r", "left": "l"}
_USUAL = 0.12  # lengths of a leg: the separation's deviation by the built-in lifter, median of lifted validation takes
NOISE = 2.0 * float(np.sqrt(2))  # standard deviations of a frame's value: twice that of a difference of two


def gait_of(motion: Motion) -> Gait:
    """Stances and walks, with steps beyond the noise that the columns state. Where the camera moves, turns of the
    person are not told from the camera's and end no walk."""
    rectified, facing = motion.rectified, None
    if not motion.moving_camera:
        facing = facing_deg(transpose(rectified.R_source_from_level) @ rectified.R_source_from_body)
    least = least_step(motion.columns, motion.unjudged)
    return find_gait(motion.body, motion.times, motion.seams, facing_deg=facing, least=least)


@dataclass(frozen=True)
class Walk:
    """A walk or a run. kind: "walking" or "running". steps: those whose feet were seen, in order; before, behind: more,
    told by the knees' rhythm where steps cannot be seen (fading.py). cut: whether its start, and its end, were not
    visible, so that there may be more."""

    kind: str
    steps: tuple[Step, ...]
    before: tuple[Step, ...] = ()
    behind: tuple[Step, ...] = ()
    cut: tuple[bool, bool] = (False, False)

    @property
    def every(self) -> tuple[Step, ...]:
        """All its steps, in order."""
        return (*self.before, *self.steps, *self.behind)


def walks_of(motion: Motion, gait: Gait) -> list[Walk]:
    """The walks of a gait, in order. Who stops stays for more than a stride, as in walks.py: where an end of the take
    or a gap lies nearer, that was not visible."""
    apart = separation(motion.body, motion.times, motion.seams)[:, 0]
    knees = {side: motion.angle(f"{side}_knee_flexion") for side in SIDES.values()}
    visible = np.isfinite(apart) | np.isfinite([*knees.values()]).all(axis=0)
    ends_s = [
        (float(motion.times[rows.start]), float(motion.times[rows.stop - 1]))
        for rows in runs(visible, motion.times, motion.seams)
    ]
    hidden = along_sight(motion.rectified.R_source_from_body, motion.source.frame) | np.isnan(apart)
    walks = []
    for i, steps in enumerate(gait.walks):
        stride_s = 2 * float(np.mean([step.stop_s - step.start_s for step in steps]))
        before, behind = [], []
        if gait.kind == "walking":
            before, behind = faded_steps(steps, knees, motion.times, hidden, motion.seams)
            since_s = walks[-1].every[-1].stop_s if walks else -np.inf
            until_s = gait.walks[i + 1][0].start_s if i + 1 < len(gait.walks) else np.inf
            before = [step for step in before if step.start_s >= since_s]
            behind = [step for step in behind if step.stop_s <= until_s]
        walk = Walk(gait.kind, tuple(steps), tuple(before), tuple(behind))
        first_s, last_s = walk.every[0].start_s, walk.every[-1].stop_s
        starts = any(0 <= first_s - start_s < stride_s for start_s, _ in ends_s)
        stops = any(0 <= stop_s - last_s < stride_s for _, stop_s in ends_s)
        walks.append(replace(walk, cut=(starts, stops)))
    return walks


def least_step(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """By how much the ankles' separation changes from landing to landing at least, in lengths of a leg, by the stated
    standard deviations in the columns (T,). unjudged: as of separation_sd."""
    return max(LEAST_STEP, NOISE * separation_sd(columns, unjudged))


def separation_sd(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """Median standard deviation of the separation, in lengths of a leg, by those that the columns (T,) state for thighs
    and shanks in degrees. Both bones are half of a leg, and the four errors are taken for independent. Where none is
    stated it is 0, or, for a lifter whose errors were not measured (unjudged), that of the built-in lifter's angles."""
    usual = _USUAL if unjudged else 0.0
    parts = [
        0.5 * np.cos(np.radians(columns[f"{name}_deg"])) * np.radians(columns[f"{name}_sd_deg"])
        for name in (f"{side}_{bone}_sagittal" for side in "rl" for bone in ("thigh", "shank"))
        if f"{name}_deg" in columns and f"{name}_sd_deg" in columns
    ]
    if len(parts) < 4:
        return usual
    sd = np.sqrt(np.sum(np.square(parts), axis=0))
    stated = sd[np.isfinite(sd)]
    return float(np.median(stated)) if len(stated) else usual
