"""What a finished take says of its walks and runs, each figure with its error against the captured feet's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import Measures
from ....pipeline.core.rotations import rotate
from ...common.metrics import SD_90
from ...gait.events import Stance, Step
from ...gait.gait import Gait
from ...gait.of_take import SIDES
from ..evaluation.acceleration import filtered
from ..evaluation.finished import Finished
from ..evaluation.gait import step_values, true_gait
from ..evaluation.people import mean
from .judge import Stated

_NEAR_S = 0.25  # of what was found, within which a true landing is the same
# What is judged by the name that is published: what `measures` calls it, and the values whose mean it is.
_FIGURES = {
    "stance, %": ("mean_stance", "stance_percent"),
    "double support, %": ("mean_double_support", "double_support_percent"),
    "single support, %": ("mean_single_support", "single_support_percent"),
    "step time, s": ("mean_step_time", "step_time_s"),
    "step length, m": ("mean_step_length", "step_length"),
    "walking speed, m/s": ("walking_speed", "walking_speed"),
}
_CADENCE = "cadence, steps/min"


def walks(finished: Finished) -> Iterator[Stated]:
    """Means of a take's walks or runs against those of the same steps in truth, of static cameras. Nothing of a take in
    which nobody walks, or no walk is found."""
    take, truth = finished.take, finished.truth
    if take is None or truth.up.ndim > 1:
        return
    walking = take.figures.group("walking")
    lands = [at for side in ("right", "left") for at in walking.group(side).times("landings")]
    if not lands:
        return
    true = true_gait(truth)
    if not any(step.start_s < max(lands) and min(lands) < step.stop_s for step in true.steps):
        return
    part = Gait(true.feet, true_walks(walking, true.feet))
    if not part.walks:
        return
    time_s = truth.keypoints.times
    world = rotate(truth.R_camera_from_world.T, truth.joints_camera)
    root = world[:, H36M17.index("pelvis")]
    values = step_values(part, root, filtered(world, time_s), time_s)
    means = {name: mean(np.concatenate([*of.values()])) for name, of in values.items()}
    stance = walking.figure("mean_stance")
    known = {} if stance is None else {"stance": np.array([stance.value])}
    for statement, (name, of) in _FIGURES.items():
        one, true_mean = walking.figure(name), means[of]
        if one is not None and one.error is not None and np.isfinite(true_mean):
            yield _stated(statement, finished, one.value - true_mean, one.error, known)
    cadence = walking.figure("cadence")
    if cadence is not None and cadence.error is not None:
        error = cadence.value - 60 / means["step_time_s"]
        yield _stated(_CADENCE, finished, error, cadence.error, known)


def true_walks(walking: Measures, feet: Mapping[str, Sequence[Stance]]) -> list[list[Step]]:
    """The true steps between the landings of those that were found. Others are no part of what is said: turns and hops
    that were not counted, and landings so late that the take does not show whether the foot came to rest. A false step
    has none: it makes the found mean wrong. walking: that group; feet: true stances by side."""
    lands = {side: walking.group(words).times("landings") for words, side in SIDES.items()}
    true = sorted((at.start_s, side) for side, of in feet.items() for at in of if np.isfinite(at.start_s))

    def nearest(at_s: float, of: str) -> int:
        """Which of the true ones; -1 of none."""
        off, i = min(
            ((abs(start - at_s), i) for i, (start, side) in enumerate(true) if side == of), default=(1.0, -1)
        )
        return i if off < _NEAR_S else -1

    pairs = set[int]()  # of true landings, one after the other, by the first
    for words, side in SIDES.items():
        other = "rl"[side == "r"]
        for start, stop in walking.group(words).spans:
            between = [nearest(at, other) for at in lands[other] if start < at < stop]
            landings = [nearest(start, side), *between, nearest(stop, side)]
            pairs |= {i for i, j in pairwise(landings) if i >= 0 and j == i + 1}
    walks: list[list[Step]] = []
    for i in sorted(pairs):
        if i - 1 not in pairs:
            walks.append([])
        walks[-1].append(Step(true[i + 1][1], true[i][0], true[i + 1][0]))
    return walks


def _stated(
    statement: str, finished: Finished, error: float, sd: float, known: dict[str, np.ndarray]
) -> Stated:
    half = np.array([SD_90 * sd])
    return Stated(statement, finished.truth.subject, np.array([error]), half, known).judged()
