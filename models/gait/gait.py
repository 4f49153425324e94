"""A take's walks and runs, found and measured: what the stage `measures` writes and evaluations judge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cached_property

import numpy as np

from ...pipeline.core.layouts import H36M17
from .contact import SIDES, contacts, leg_lengths
from .events import Stance, Step, Stride, stances, strides, walks

_RUN_STEP_S = 0.6  # a step of a run, at most: of the slowest jogs 0.45
# Seconds of double support, and of the strides, from which a run has walked steps too: 19 of 26 lifted takes of which
# most steps are walked, none of 84 runs (validation people).
_BOTH_S, _SOME = 0.03, 0.2
# Of the time of a walk each foot is on the floor, mean of those that contacts were learned from.
_USUAL_SHARE = 0.62
_ITERATIONS = 30
_BESIDE_S = 0.3  # of a walk before its first landing and after its last, walked alike
LEAST_STEP = 0.25  # lengths of a leg: by how much the ankles' separation changes from step to step at least


@dataclass(frozen=True, eq=False)
class Gait:
    """feet: stances by side "r" and "l", in walks and elsewhere. walks: of three steps or more, in order."""

    feet: dict[str, list[Stance]]
    walks: list[list[Step]]

    @cached_property
    def steps(self) -> list[Step]:
        """Of all walks, in order."""
        return [step for walk in self.walks for step in walk]

    @cached_property
    def kind(self) -> str:
        """ "running" where most strides have flights and steps are as quick as people run, else "walking"; "none"
        without a walk."""
        if not self.walks:
            return "none"
        return "running" if self.flies and _step_s(self.steps) <= _RUN_STEP_S else "walking"

    @cached_property
    def _flights_s(self) -> np.ndarray:
        flights = np.concatenate([*time_values(self)["flight_time_s"].values()])
        return flights[np.isfinite(flights)]

    @cached_property
    def flies(self) -> bool:
        """Whether most strides have flights."""
        return bool(len(self._flights_s) and np.median(self._flights_s) > 0)

    @cached_property
    def mixed(self) -> bool:
        """Whether a run has walked steps too: in some strides two feet are clearly on the floor."""
        return self.kind == "running" and bool((self._flights_s < -_BOTH_S).mean() >= _SOME)

    @cached_property
    def strides(self) -> list[Stride]:
        """Of all walks, in order."""
        return strides(self.walks, self.feet)


def find_gait(
    body: np.ndarray,
    time_s: np.ndarray,
    seams: Sequence[int] = (),
    facing_deg: np.ndarray | None = None,
    least: float = LEAST_STEP,
) -> Gait:
    """The stances and walks of a take.

    body: (T, 17, 3) H36M17 in BODY axes relative to the pelvis, through the usual 6 Hz low-pass; time_s: (T,).
    facing_deg: (T,) in still axes, None where the camera moves, and then turns are not told from walks. least: a step's
    change of the ankles' separation in lengths of a leg.
    """
    probability = contacts(body, time_s, tuple(seams))
    apart = separation(body, time_s, seams)

    def gait_of(probability: Mapping[str, np.ndarray]) -> Gait:
        feet = stances(probability, time_s, seams)
        steps_in_turn = walks(feet, apart, time_s, least, seams, facing_deg)
        # Slow steps with flights are leaps, or stances were missed.
        return Gait(feet, [walk for walk in steps_in_turn if not slow_flights(feet, walk)])

    gait = gait_of(probability)
    if gait.kind != "walking":
        return gait
    again = gait_of(as_walked(probability, time_s, gait.walks))
    return again if again.walks else gait


def as_walked(
    probability: Mapping[str, np.ndarray], time_s: np.ndarray, walks: Sequence[Sequence[Step]]
) -> dict[str, np.ndarray]:
    """The probabilities (T,) of contacts by side for those who walk like that: the network was taught how long feet
    usually stand, and doubtful frames lean towards it. How long they do in a walk is the share under which its
    probabilities agree with themselves (expectation maximisation: Saerens, Latinne & Decaestecker, Neural Computation
    14(1), 2002)."""
    result = {side: values.copy() for side, values in probability.items()}
    for walk in walks:
        first, last = walk[0].start_s, walk[-1].stop_s
        inside = np.concatenate(
            [values[(time_s >= first) & (time_s <= last)] for values in probability.values()]
        )
        inside = inside[np.isfinite(inside)]
        share = _USUAL_SHARE
        for _ in range(_ITERATIONS):
            share = float(_with_share(inside, share).mean())
        rows = (time_s >= first - _BESIDE_S) & (time_s <= last + _BESIDE_S)
        for side, values in probability.items():
            result[side][rows] = _with_share(values[rows], share)
    return result


def _with_share(probability: np.ndarray, share: float) -> np.ndarray:
    on, off = probability * share / _USUAL_SHARE, (1 - probability) * (1 - share) / (1 - _USUAL_SHARE)
    return on / (on + off)


def slow_flights(feet: dict[str, list[Stance]], walk: list[Step]) -> bool:
    """Whether steps with flights follow each other more slowly than anybody runs."""
    return Gait(feet, [walk]).flies and _step_s(walk) > _RUN_STEP_S


def _step_s(steps: Sequence[Step]) -> float:
    return float(np.median([step.stop_s - step.start_s for step in steps]))


def separation(body: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> np.ndarray:
    """(T, 2) how far the right ankle is in front of the left one and to its right, in lengths of a leg. body: (T, 17,
    3) in BODY axes; time_s: (T,)."""
    between = body[:, H36M17.index("r_ankle"), :2] - body[:, H36M17.index("l_ankle"), :2]
    return between * (-1, 1) / leg_lengths(body, time_s, seams)[:, None]  # BODY's x is back, its y is right


def facing_deg(R_level_from_body: np.ndarray) -> np.ndarray:
    """(T,) where the person faces about LEVEL's z, by rotations (T, 3, 3)."""
    return np.degrees(np.arctan2(-R_level_from_body[:, 1, 0], -R_level_from_body[:, 0, 0]))


Values = dict[str, dict[str, np.ndarray]]


def time_values(gait: Gait) -> Values:
    """{figure: {"r", "l": (N,) of that side's steps or strides}}, NaN where an event is not seen.

    step_time_s, stride_time_s, stance_time_s, swing_time_s; stance_percent, swing_percent, single_support_percent and
    double_support_percent of the stride: the other foot's swing, when only this one bears the body, in a run the
    stance; and both supports together, negative where the feet leave before the other lands (a run). flight_time_s, of
    one flight, by the stride's two or the one that is seen, negative in a walk.
    """
    result: Values = {}
    for side in SIDES:
        own = [astuple(stride)[1:] for stride in gait.strides if stride.side == side]
        start, stop, off, other_off, other_start = np.array(own, dtype=np.float64).reshape(-1, 5).T
        stride, stance, swing = stop - start, off - start, stop - off
        # From this foot's initial contact to the other's toe-off, and from the other's initial contact to this one's
        # toe-off: support by both where positive, flight where negative.
        first, last = other_off - start, off - other_start
        single = np.minimum(other_start, off) - np.maximum(other_off, start)
        row = {
            "step_time_s": np.array(
                [s.stop_s - s.start_s for s in gait.steps if s.side == side], dtype=np.float64
            ),
            "stride_time_s": stride,
            "stance_time_s": stance,
            "swing_time_s": swing,
            "stance_percent": 100 * stance / stride,
            "swing_percent": 100 * swing / stride,
            "single_support_percent": 100 * single / stride,
            "double_support_percent": 100 * (first + last) / stride,
            "flight_time_s": -_seen_mean(first, last),
        }
        for name, values in row.items():
            result.setdefault(name, {})[side] = values
    return result


def _seen_mean(first: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(N,) the mean of two values, or the one that is finite."""
    return (np.where(np.isfinite(first), first, other) + np.where(np.isfinite(other), other, first)) / 2
