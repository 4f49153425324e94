"""The gait of a take's motion, its walks, and how far the legs come apart in its noise.

Steps go on before and behind a walk where they cannot be seen: those of somebody who comes towards the camera, or goes
away from it, are depth, and shrink in the image. The knees keep their rhythm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...pipeline.core.frames import Frame
from ...pipeline.core.rotations import transpose
from ...pipeline.signals.filters import peaks, runs
from ..common.motion import Motion
from .contact import OTHER
from .gait import LEAST_STEP, Gait, Step, facing_deg, find_gait, separation

SIDES = {"right": "r", "left": "l"}
_USUAL = 0.12  # lengths of a leg: the separation's deviation by the built-in lifter, median of lifted validation takes
NOISE = 2.0 * float(np.sqrt(2))  # standard deviations of a frame's value: twice that of a difference of two
# Of the line of sight, within which a person faces the camera or turns the back to it: a step there shows at most
# sin 40 = 64 % of its length.
_SIGHT_DEG = 40.0
_OFF = 0.3  # of a step's time, by which a swing may come too early or too late
# Of the usual swing of a walk: by so much a knee bends at least, and at most, in one that goes on; less is a step to a
# stop. By so much it is bent more than the other one: who crouches bends both.
_SWINGS, _MORE = (0.65, 1.5), 0.3
_LEAST_DEG = 3.0  # of a peak: a lifted knee's noise from frame to frame


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
    """A walk or a run. steps: those whose feet were seen, in order; every: with those before and behind that the knees'
    rhythm tells where steps cannot be seen (`faded_steps`). cut: whether its start, and its end, were not visible, so
    that there may be more."""

    steps: tuple[Step, ...]
    every: tuple[Step, ...]
    cut: tuple[bool, bool]


def walks_of(motion: Motion, gait: Gait) -> list[Walk]:
    """The walks of a gait, in order. Who stops stays for more than a stride, as in `walks`: where an end of the take
    or a gap lies nearer, that was not visible."""
    apart = separation(motion.body, motion.times, motion.seams)[:, 0]
    knees = {side: motion.angle(f"{side}_knee_flexion") for side in SIDES.values()}
    visible = np.isfinite(apart) | np.isfinite([*knees.values()]).all(axis=0)
    ends_s = [
        (float(motion.times[rows.start]), float(motion.times[rows.stop - 1]))
        for rows in runs(visible, motion.times, motion.seams)
    ]
    hidden = along_sight(motion.rectified.R_source_from_body, motion.source.frame) | np.isnan(apart)
    swings = {side: swings_of(x, motion.times, motion.seams) for side, x in knees.items()}
    walks = []
    for i, steps in enumerate(gait.walks):
        stride_s = 2 * float(np.mean([step.stop_s - step.start_s for step in steps]))
        before, behind = [], []
        if gait.kind == "walking":
            before, behind = faded_steps(steps, knees, swings, motion.times, hidden)
            since_s = walks[-1].every[-1].stop_s if walks else -np.inf
            until_s = gait.walks[i + 1][0].start_s if i + 1 < len(gait.walks) else np.inf
            before = [step for step in before if step.start_s >= since_s]
            behind = [step for step in behind if step.stop_s <= until_s]
        every = (*before, *steps, *behind)
        first_s, last_s = every[0].start_s, every[-1].stop_s
        starts = any(0 <= first_s - start_s < stride_s for start_s, _ in ends_s)
        stops = any(0 <= stop_s - last_s < stride_s for _, stop_s in ends_s)
        walks.append(Walk(tuple(steps), every, (starts, stops)))
    return walks


def along_sight(R_source_from_body: np.ndarray, source: Frame) -> np.ndarray:
    """(T,) in which frames a person faces the camera or turns the back to it; none where the source is no camera.
    R_source_from_body: (T, 3, 3)."""
    if source.family != "camera":
        return np.zeros(len(R_source_from_body), dtype=bool)
    ahead = -R_source_from_body[:, :, 0] @ source.basis[:, 2]  # BODY's x is back, CAMERA's z is away
    return np.nan_to_num(np.abs(ahead)) > np.cos(np.radians(_SIGHT_DEG))


def faded_steps(
    walk: Sequence[Step],
    knees: Mapping[str, np.ndarray],
    swings: Mapping[str, np.ndarray],
    time_s: np.ndarray,
    hidden: np.ndarray,
) -> tuple[list[Step], list[Step]]:
    """Steps before a walk and behind it, in order, by the swings of the knees, which keep the walk's rhythm.

    knees: {"r", "l": (T,)} degrees of flexion at time_s (T,), NaN where not known; swings: `swings_of` each. hidden:
    (T,) in which frames steps cannot be seen, along the line of sight or without the ankles. Of 71 landings that this
    adds to 103 lifted walks of validation people, were all their frames hidden, 65 are within 0.25 s of one of that
    foot, and most within 0.05 s.
    """
    step_s = float(np.median([step.stop_s - step.start_s for step in walk]))
    knee_peaks = []  # how long before the foot lands its knee is bent most in each step, and by how much
    for step in walk:
        at_s, height = swings[step.side].T
        inside = slice(np.searchsorted(at_s, step.start_s, side="right"), np.searchsorted(at_s, step.stop_s))
        if len(at_s[inside]):
            most = inside.start + int(height[inside].argmax())
            knee_peaks.append((step.stop_s - at_s[most], height[most]))
    if not knee_peaks:
        return [], []
    lag_s, usual = np.median(knee_peaks, axis=0)

    def lands(side: str, near_s: float) -> float | None:
        """When the foot of a side lands about then, after its knee has swung where steps cannot be seen."""
        off_s = np.abs(swings[side][:, 0] + lag_s - near_s)
        near = np.flatnonzero(off_s <= _OFF * step_s)
        for at_s, height in swings[side][near[np.argsort(off_s[near], kind="stable")]]:
            rows = np.searchsorted(time_s, [at_s, at_s + lag_s])
            if rows[1] >= len(time_s):
                return None
            bent, other = knees[side][rows[0]], knees[OTHER[side]][rows[0]]
            alone = not bent - other < _MORE * usual  # or the other is not known
            fits = alone and _SWINGS[0] * usual <= height <= _SWINGS[1] * usual
            if fits and hidden[rows[0]]:
                return at_s + lag_s
        return None

    behind, before = [walk[-1]], [walk[0]]
    while (at_s := lands(OTHER[behind[-1].side], behind[-1].stop_s + step_s)) is not None:
        behind.append(Step(OTHER[behind[-1].side], behind[-1].stop_s, at_s))
    while (at_s := lands(before[0].side, before[0].start_s - step_s)) is not None:
        before.insert(0, Step(OTHER[before[0].side], at_s, before[0].start_s))
    return before[:-1], behind[1:]


def swings_of(knee: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(N, 2) when a knee's flexion (T,) is largest, each time, in order, and how large it is."""
    pieces = runs(np.isfinite(knee), time_s, seams)
    tops = [piece.start + row for piece in pieces for row in peaks(knee[piece], _LEAST_DEG)]
    return np.stack([time_s[tops], knee[tops]], axis=-1) if tops else np.zeros((0, 2))


def least_step(columns: Mapping[str, np.ndarray], unjudged: bool = False) -> float:
    """By how much the ankles' separation changes from landing to landing at least, in lengths of a leg: beyond its
    median standard deviation by those that the columns (T,) state for thighs and shanks in degrees. Both bones are half
    of a leg, and the four errors are taken for independent. Where none is stated it is 0, or, for a lifter whose errors
    were not measured (unjudged), that of the built-in lifter's angles."""
    usual = _USUAL if unjudged else 0.0
    parts = [
        0.5 * np.cos(np.radians(columns[f"{name}_deg"])) * np.radians(columns[f"{name}_sd_deg"])
        for name in (f"{side}_{bone}_sagittal" for side in "rl" for bone in ("thigh", "shank"))
        if f"{name}_deg" in columns and f"{name}_sd_deg" in columns
    ]
    sd = np.sqrt(np.sum(np.square(parts), axis=0)) if len(parts) == 4 else np.zeros(0)
    stated = sd[np.isfinite(sd)]
    return max(LEAST_STEP, NOISE * (float(np.median(stated)) if len(stated) else usual))
