"""What a finished take says of its walks and runs, each figure with its error against the captured feet's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import grouped, measure, moments, subgroup
from ....pipeline.core.rotations import rotate
from ...common.metrics import SD_90
from ...gait.gait import Gait
from ..evaluation.acceleration import filtered
from ..evaluation.finished import Finished
from ..evaluation.gait import step_values, true_gait
from ..evaluation.people import mean
from .judge import Stated

_NEAR_S = 0.25  # of what was found, within which a true step is the same
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
    """Means of a take's walks or runs against those of the true steps in the same time, of static cameras. Nothing of
    a take in which nobody walks, or no walk is found."""
    take, truth = finished.take, finished.truth
    if take is None or truth.up.ndim > 1:
        return
    found = subgroup(grouped(take.measures or ()), "walking")
    lands = [at for side in ("right", "left") for at in moments(subgroup(found, side), "landings")]
    if not lands:
        return
    gait, first_s, last_s = true_gait(truth, finished.spells), min(lands) - _NEAR_S, max(lands) + _NEAR_S
    near = (
        [step for step in walk if first_s <= step.start_s and step.stop_s <= last_s] for walk in gait.walks
    )
    part = Gait(gait.feet, [walk for walk in near if walk])
    if not part.walks:
        return
    time_s = truth.keypoints.times
    world = rotate(truth.R_camera_from_world.T, truth.joints_camera)
    root = world[:, H36M17.index("pelvis")]
    values = step_values(part, root, filtered(world, time_s), time_s)
    means = {name: mean(np.concatenate([*of.values()])) for name, of in values.items()}
    stance = measure(found, "mean_stance")
    known = {} if stance is None else {"stance": np.array([stance.value])}
    for statement, (name, of) in _FIGURES.items():
        one, true_mean = measure(found, name), means[of]
        if one is not None and one.error is not None and np.isfinite(true_mean):
            yield _stated(statement, finished, one.value - true_mean, one.error, known)
    cadence = measure(found, "cadence")
    if cadence is not None and cadence.error is not None:
        error = cadence.value - 60 / means["step_time_s"]
        yield _stated(_CADENCE, finished, error, cadence.error, known)


def _stated(
    statement: str, finished: Finished, error: float, sd: float, known: dict[str, np.ndarray]
) -> Stated:
    half = np.array([SD_90 * sd])
    return Stated(statement, finished.truth.subject, np.array([error]), half, known).judged()
