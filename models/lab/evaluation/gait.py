"""Contacts, steps and gait figures of runs where the truth is known:  pcnet3d lab evaluate gait -o DIR

What a run's rows say of the walks of people nobody was trained on, in metres by their stature, beside the contacts of
the motion capture (`true_contact`) and the same figures by them. Every take is run with the focal length
told, and for lengths and speed once more with the usual one assumed.

Errors are p50 / mean / p95 of their size: events over events, figures over takes (of the means that a run states,
against those of the same steps). events: of walks. steps: found, true. inside: takes whose true mean lies within the
stated 90 %. false steps: found in takes without a walk.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.figures import FIGURES
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import Measures
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.core.take import Take
from ....pipeline.signals.filters import derivative, runs
from ...angle_error.take_angles import smoothed
from ...common.canonical import R_world_from_body
from ...common.metrics import relative
from ...gait.figures import OF_LENGTH, OF_SIDES, length_values
from ...gait.gait import (
    FEWEST,
    LEAST_STEP,
    SIDES,
    Gait,
    Stance,
    Step,
    contact_times,
    facing_deg,
    separation,
    slow_flights,
)
from ...gait.gait import walks as walks_of
from ..beds import Configuration, Finished, SeenTake, finished
from ..cases import Cases, Figure, Row, mean, summed

SIDES_APART = ", right less left"  # behind the name of a figure
PATHS = {"focal known": True, "focal assumed": False}
_UNEVEN = 2.5  # captured validation walks and runs come to 2.4, one of skips to 2.7, a man who hops to 3.4
_NEAR_S = 0.25  # an event that is found farther off is another one
# Names of models.gait that are measured, by the names of their means among a run's rows.
_ROWS = {
    "walking_speed" if figure.name == "walking_speed" else f"mean_{figure.name}": figure.key
    for figure in FIGURES.values()
    if figure.group == "walking" and figure.key in (*OF_SIDES, *OF_LENGTH, "stride_time_s", "swing_time_s")
}


class Matched(NamedTuple):
    """Events of one take: errors (K,) in s of those that are found and true, how many were found, how many are true."""

    errors: np.ndarray
    found: int
    true: int


def rows(asked: Configuration) -> Iterator[Row]:
    """("sets", label, "walking" or "running" by the true contacts, "takes", "steps", "found" and "true", "events",
    event: Matched, and "figures", figure: Cases), and ("sets", label, "false steps"), of takes without a walk; nothing
    of takes that a run refuses or cannot level."""
    for path, known in PATHS.items():
        for run in finished(replace(asked, focal_known=known)):
            if not run.levelled:
                continue
            true = true_gait(run.truth)
            place, walked = ("sets", run.label, true.kind), true.kind != "none"
            if known:
                steps = sum(run.done.figures.group("walking", words).count("steps") for words in SIDES)
                yield ("sets", run.label, "false steps"), 0 if walked else steps
            if not walked:
                continue
            if known:
                yield (*place, "takes"), 1
                yield (*place, "steps", "found"), steps
                yield (*place, "steps", "true"), len(true.steps)
                yield from (((*place, "events", event), of) for event, of in events(run.done, true).items())
            for figure, cases in walks(run, true):
                of_length = figure.removesuffix(SIDES_APART) in OF_LENGTH
                if of_length or known:
                    yield (*place, "figures", f"{figure}, {path}" if of_length else figure), cases


def summary(values: list[Any]) -> dict[str, Any]:
    """Of what stands in one place of all takes."""
    if isinstance(values[0], Cases):
        return summed(values)
    errors, found, true = zip(*values, strict=True)
    error = np.concatenate(errors)
    return {
        "precision": len(error) / max(sum(found), 1),
        "recall": len(error) / max(sum(true), 1),
        "bias_ms": float(1000 * np.median(error)) if len(error) else np.nan,
        "error_ms": Figure.of(1000 * np.abs(error)),
    }


def events(take: Take, true: Gait) -> dict[str, Matched]:
    """Those of walks that were found, and the true ones."""
    sides = {side: take.figures.group("walking", words) for words, side in SIDES.items()}
    off_s = {side: [stride.off_s for stride in true.strides if stride.side == side] for side in sides}
    lands = [(rows.times("landings"), contact_times(true.walks, side)) for side, rows in sides.items()]
    leaves = [
        (rows.times("toe_offs"), [at for at in off_s[side] if np.isfinite(at)])
        for side, rows in sides.items()
    ]
    return {"initial contact": matched(lands), "toe-off": matched(leaves)}


def matched(sides: Sequence[tuple[Sequence[float], Sequence[float]]]) -> Matched:
    """The events found that are the nearest to a true one and have it nearest; (found, true) seconds of each side."""
    errors: list[float] = []
    for found, true in sides:
        if len(found) and len(true):
            off = np.subtract.outer(found, true)
            nearest = np.abs(off).argmin(axis=1)
            mutual = np.abs(off).argmin(axis=0)[nearest] == np.arange(len(off))
            own = off[np.arange(len(off)), nearest]
            errors += own[mutual & (np.abs(own) < _NEAR_S)].tolist()
    return Matched(np.array(errors), *(sum(map(len, of)) for of in zip(*sides, strict=True)))


def true_gait(seen: SeenTake) -> Gait:
    """By the captured joints, before a static camera. Skips and hops are no walk: the longest step of a walk takes at
    most _UNEVEN times as long as its shortest."""
    time_s, R_world_from_camera = seen.time_s, seen.R_camera_from_world.T
    spells = true_contact(seen.world, time_s)
    feet = {side: [Stance(side, *map(float, spell)) for spell in spells[side]] for side in SIDES.values()}
    body = rotate(transpose(seen.R_camera_from_body), smoothed(seen.truth, time_s))
    facing = facing_deg(R_world_from_camera @ seen.R_camera_from_body)
    steps_in_turn = walks_of(feet, separation(body, time_s), time_s, LEAST_STEP, facing_deg=facing)
    # Contacts are known, so slow steps with flights are long strides.
    known = [walk for walk in steps_in_turn if len(walk) >= FEWEST or not slow_flights(feet, walk)]
    return Gait(feet, [walk for walk in known if _even(walk)])


def _even(walk: Sequence[Step]) -> bool:
    times = [step.stop_s - step.start_s for step in walk]
    return max(times) <= _UNEVEN * min(times)


def walks(run: Finished, true: Gait) -> Iterator[tuple[str, Cases]]:
    """Means of a take's walks or runs, by the names of models.gait, against those of the same steps in truth, and
    those of the right side less the left's; of static cameras. true: `true_gait` of the truth. Nothing of a take in
    which nobody walks, or no walk is found."""
    walking = run.done.figures.group("walking")
    lands = [at for side in SIDES for at in walking.group(side).times("landings")]
    if not any(step.start_s < max(lands) and min(lands) < step.stop_s for step in true.steps if lands):
        return
    same = Gait(true.feet, true_walks(walking, true.feet))
    if not same.walks:
        return
    time_s, world = run.truth.time_s, run.truth.world
    level = relative(smoothed(world, time_s))
    ankles = {side: level[:, H36M17.index(f"{side}_ankle"), :2] for side in SIDES.values()}
    root = world[:, H36M17.index("pelvis"), :2]
    values = same.times | length_values(same, root, ankles, time_s)
    means = {name: mean(np.concatenate([*of.values()])) for name, of in values.items()}
    named = [(row, name, means[name]) for row, name in _ROWS.items()]
    for row, name, of in [*named, ("cadence", "cadence", 60 / means["step_time_s"])]:
        found = walking.figure(row)
        if found is not None and np.isfinite(of):
            yield name, run.figure(found.value, of, found.error)
    for row, name in _ROWS.items():
        right, left = (walking.group(side).value(row) for side in SIDES)
        off = mean(values[name]["r"]) - mean(values[name]["l"])
        if right is not None and left is not None and np.isfinite(off):
            # In per cent of the sides' mean.
            index = walking.figure(f"{row.removeprefix('mean_')}_symmetry_index")
            percent = None if index is None else index.error
            error = None if percent is None else percent / 100 * (right + left) / 2
            yield name + SIDES_APART, run.figure(right - left, off, error)


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
    steps: list[list[Step]] = []
    for i in sorted(pairs):
        if i - 1 not in pairs:
            steps.append([])
        steps[-1].append(Step(true[i + 1][1], true[i][0], true[i + 1][0]))
    return steps


# When a foot of motion capture is on the floor. The layout has one joint of the foot, the ankle, so the foot itself is
# put below it. A foot rests where its ankle is slower than 0.5 m/s and within 6 cm of that foot's own floor level.
# There it lies flat: its forefoot, the heads of the metatarsals, is 0.08 statures ahead of the ankle as the person
# faces, and 0.03 below it (a foot is 0.152 statures long and the ankle 0.039 high; Winter, Biomechanics and Motor
# Control of Human Movement, 4th ed. 2009, figure 4.1). The contact goes on, to both sides of the rest, for as long as
# the ankle can be where it is with some part of the foot in place: within 3.5 cm of its place at rest, or at its
# distance from the forefoot, within 2.5 cm (the heel is off, and the ankle turns about the forefoot until the toes
# leave). By 3.5 cm an ankle 8 cm from the end of its heel moves while a foot that landed with its toes up by 25 degrees
# comes down.
#
# On the walks of the train subjects a stance then takes 61 % of a stride and double support 22 %, as in gait
# laboratories (with 5 cm 63 and 25 %). On a walk annotated elsewhere (gaitkit 1.5.0, one person, six landings) feet
# land 16 ms early in the median (with 5 cm 33) and leave 44 to 66 ms late.
_RESTS_MPS = 0.5
_LOW_M = 0.06  # above the foot's own floor level
_FLOOR_SHARE = 5.0  # percentile of the ankle's height that is its floor level
_AHEAD, _BELOW = 0.08, 0.03  # statures: the forefoot's joints ahead of the ankle and below it
_SETTLES_M = 0.035
_ON_ARC_M = 0.025


def true_contact(joints: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """{"r", "l": (N, 2) initial contact and toe-off in seconds}, in order; NaN where the take begins or ends so.

    joints: (T, 17, 3) metres, H36M17, a still world with +Z up and one level floor; time_s (T,).
    """
    joints = joints.astype(np.float64)
    ahead = -R_world_from_body(joints)[..., 0]
    stature = implied_stature(joints)
    return {side: _spells(joints[:, H36M17.index(f"{side}_ankle")], ahead, stature, time_s) for side in "rl"}


def _spells(ankle: np.ndarray, ahead: np.ndarray, stature: float, time_s: np.ndarray) -> np.ndarray:
    speed = np.linalg.norm(derivative(ankle, time_s), axis=-1)
    floor = np.percentile(ankle[:, 2], _FLOOR_SHARE)
    found: list[list[float]] = []
    for rest in runs((speed < _RESTS_MPS) & (ankle[:, 2] < floor + _LOW_M), time_s):
        flat = rest.start + int(np.argmin(speed[rest]))
        off = _off(ankle, flat, ahead[flat], stature)
        start = _leaves(off[: flat + 1][::-1], time_s[: flat + 1][::-1])
        stop = _leaves(off[flat:], time_s[flat:])
        if found and not start > found[-1][1]:  # another rest of the same contact
            found[-1][1] = stop if np.isnan(stop) or stop > found[-1][1] else found[-1][1]
        else:
            found.append([start, stop])
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def _off(ankle: np.ndarray, flat: int, ahead: np.ndarray, stature: float) -> np.ndarray:
    """(T,) by how much an ankle (T, 3) is beyond what a foot that rests in row `flat` allows: 0 and less is contact,
    in shares of what is allowed."""
    place = ankle[flat]
    forefoot = place + stature * (_AHEAD * ahead - (0.0, 0.0, _BELOW))
    moved = np.linalg.norm(ankle - place, axis=-1) / _SETTLES_M - 1
    arc = np.abs(np.linalg.norm(ankle - forefoot, axis=-1) - np.linalg.norm(place - forefoot)) / _ON_ARC_M - 1
    return np.minimum(moved, arc)


def _leaves(off: np.ndarray, time_s: np.ndarray) -> float:
    """The moment at which `off` becomes positive for the first time, between rows; NaN if it does not."""
    beyond = np.flatnonzero(off > 0)
    if not len(beyond):
        return float("nan")
    row = int(beyond[0])
    return float(np.interp(0.0, off[row - 1 : row + 1], time_s[row - 1 : row + 1]))
