"""Whether a take's clock is right, by what nobody chooses: how fast a body falls, and how quickly legs swing in a walk.

In the air nothing but gravity pulls. On the ground legs swing as pendulums do: long steps take their time, and slow
steps are short. Twice the rate, or half of it, is beyond what people do; a quarter more or less is within it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...pipeline.core.layouts import H36M17
from ...pipeline.core.notices import Notice, notice
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import angle_deg
from ..place.flights import GRAVITY, falls

_STATURE_M = 1.7  # of an adult; of people 1.2 to 2 m tall gravity's fall is within a fifth of the clock
_OFF = 1.5  # times too slow, or too fast, by falls; slow motion is of twice and more


class _Limit(NamedTuple):
    usual: float
    limit: float


# Seconds from passing to passing for each length of a leg that the ankles come apart: 0.50 to 0.98 in 23 lifted walks
# of validation people, 0.25 and more in runs.
_QUICK = {"walk": _Limit(0.68, 0.47), "run": _Limit(0.40, 0.22)}
# Seconds times lengths of a leg (the walk ratio: Sekiya & Nagasaki, Gait Posture 7(3), 1998): 0.32 to 0.79 in 64 lifted
# takes of validation people, skips and huge steps above 0.6, and less of patients.
_SLOW = _Limit(0.44, 0.80)
# Degrees of the straighter knee as the legs pass: 11 to 28 in lifted walks, 36 in the longest strides; 29 to 68 in
# runs. Deeper knees are of lunges, which take any time.
_WALKS_DEG, _RUNS_DEG = 29.0, 75.0
_STEP = 0.25  # lengths of a leg: by how much the ankles' separation changes from step to step at least
_FEWEST = 4  # steps
# Of the times from passing to passing, quartile by quartile, and the spread of how far the ankles come apart.
_EVEN, _ALIKE = 1.35, 0.2


def clock_doubts(level: PoseSequence) -> list[Notice]:
    """A notice where a body in the air, or the legs of a walk, are slower or faster than gravity makes them.

    level: as for `falls`; not filtered, for a filter takes the more of a movement the quicker its clock is.
    """
    fell = falls(level)
    times = float(np.sqrt(np.median(fell) * _STATURE_M / GRAVITY)) if len(fell) else 1.0  # as fast as it was
    movement = f"the body falls at {times**2:.2g} of gravity in the air"
    if 1 / _OFF < times < _OFF:
        gait = _gait(level)
        times = 1.0 if gait is None else _too_quick(gait)
        movement = (
            "" if gait is None else f"the legs of a walk or run pass each other every {gait.step_s:.2f} s"
        )
    if times == 1.0:
        return []
    way = "quickly" if times > 1 else "slowly"
    values = {"fps": level.fps, "movement": movement, "way": way, "fits": level.fps / times}
    return [notice("rate-against-movement", times=max(times, 1 / times), **values)]


@dataclass(frozen=True)
class _Gait:
    """Legs that pass each other evenly. step_s: median time from one passing to the next; reach: how far the ankles
    come apart between, in lengths of a leg; knee_deg: median flexion of the straighter knee as they pass."""

    step_s: float
    reach: float
    knee_deg: float


def _too_quick(gait: _Gait) -> float:
    """How many times too quickly legs swing, below 1 where too slowly; 1 within what people do."""
    quick = _QUICK["walk" if gait.knee_deg < _WALKS_DEG else "run"]
    if gait.step_s < quick.limit * gait.reach:
        return quick.usual * gait.reach / gait.step_s
    if gait.step_s * gait.reach > _SLOW.limit:
        return _SLOW.usual / (gait.step_s * gait.reach)
    return 1.0


def _gait(level: PoseSequence) -> _Gait | None:
    """None where the ankles do not pass each other evenly at least four times."""
    if len(level) < 2 or level.time_s is None:
        return None
    at = {name: level.joint(name).astype(np.float64) for name in H36M17.joints}
    forward = np.cross(at["l_hip"] - at["r_hip"], at["thorax"] - at["pelvis"])
    leg = sum(
        np.linalg.norm(at[f"l_{b}"] - at[f"l_{a}"], axis=-1) for a, b in pairwise(("hip", "knee", "ankle"))
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        length = np.linalg.norm(forward, axis=-1) * leg
        apart = ((at["l_ankle"] - at["r_ankle"]) * forward).sum(axis=-1) / length
        straighter = np.fmin(
            *(angle_deg(at[f"{s}_knee"] - at[f"{s}_hip"], at[f"{s}_ankle"] - at[f"{s}_knee"]) for s in "rl")
        )
    there = np.isfinite(apart)
    apart, time_s, straighter = apart[there], level.times[there], straighter[there]
    sides = np.sign(apart) * (np.abs(apart) > _STEP / 2)
    rows = np.flatnonzero(sides)
    turns = np.flatnonzero(np.diff(sides[rows]))
    if len(turns) < _FEWEST:
        return None
    spans = [slice(rows[turn], rows[turn + 1] + 1) for turn in turns]
    passes = np.array([span.start + int(np.abs(apart[span]).argmin()) for span in spans])
    gaps = np.diff(time_s[passes])
    early, late = np.percentile(gaps, [25, 75])
    reach = np.array([np.abs(apart[a : b + 1]).max() for a, b in pairwise(passes)])
    knee_deg = float(np.median(straighter[passes]))
    if not (late < _EVEN * early and reach.std() < _ALIKE * reach.mean()) or not knee_deg < _RUNS_DEG:
        return None
    return _Gait(float(np.median(gaps)), float(np.median(reach)), knee_deg)
