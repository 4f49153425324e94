"""Every figure that a finished take's measures state, joined with what is true of it.

The run's rows name the figure and its error. What is true comes from the bed: the captured feet for walks, the captured
flights for jumps (jumps.py), the same rows of a run on the captured joints for repeated movements, and the true angles
over the same frames for ranges of motion and for repetitions of an angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90, Measure, Measures
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, MIDLINE, continuous, near, of_both
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import TakeJoints, smoothed, take_angles
from ...gait.events import Stance, Step
from ...gait.gait import Gait
from ...gait.of_take import SIDES
from .gait import step_values, true_gait
from .judge import Case, Stated, of_cases
from .jumps import compared
from .people import mean
from .runs import Finished
from .testbed import SeenTake, filtered

_NEAR_S = 0.25  # of what was found, within which a true landing is the same
_SEEN = 0.95  # of the frames of a found range, whose truth is known
# Rows of the group `walking`, and the values whose mean is true of them.
_OF_WALKS = {
    "stance, %": ("mean_stance", "stance_percent"),
    "double support, %": ("mean_double_support", "double_support_percent"),
    "single support, %": ("mean_single_support", "single_support_percent"),
    "step time, s": ("mean_step_time", "step_time_s"),
    "step length, m": ("mean_step_length", "step_length"),
    "walking speed, m/s": ("walking_speed", "walking_speed"),
    "cadence, steps/min": ("cadence", "cadence"),
}
_OF_MOVEMENTS = {"mean_rise": "mean rise, deg", "mean_duration": "mean duration, s"}
_MOVEMENTS = {
    "knee bends": [("knee_bends",)],
    "arm raises": [("arm_raises", side) for side in ("right", "left")],
}
_DRIVES = {"arm_raises.right": "r_shoulder_elevation", "arm_raises.left": "l_shoulder_elevation"}


def figures(finished: Finished) -> Iterator[Stated]:
    """Every figure with an error whose truth is known; nothing of a take that a run refuses or cannot level."""
    take, truth = finished.take, finished.truth
    if take is None or not take.need("rectified").level_ok:
        return
    lifted, static = take.need("poses").made_by.kind == "estimated", truth.up.ndim == 1
    cases = [*compared(take, truth).cases]
    if static:
        cases += walks(take, truth)
    if lifted and static:
        cases += movements(finished, take)
    if lifted and take.kinematics:
        cases += within(take, true_angles(truth, take.need("poses").frame_index))
    yield from of_cases(cases, truth.subject)


def walks(take: Take, truth: SeenTake) -> Iterator[Case]:
    """Means of a take's walks or runs against those of the same steps in truth, of static cameras. Nothing of a take in
    which nobody walks, or no walk is found."""
    walking = take.figures.group("walking")
    lands = [at for side in SIDES for at in walking.group(side).times("landings")]
    if not lands:
        return
    true = true_gait(truth)
    if not any(step.start_s < max(lands) and min(lands) < step.stop_s for step in true.steps):
        return
    part = Gait(true.feet, true_walks(walking, true.feet))
    if not part.walks:
        return
    time_s = truth.keypoints.times
    root = truth.world[:, H36M17.index("pelvis")]
    values = step_values(part, root, filtered(truth.world, time_s), time_s)
    means = {name: mean(np.concatenate([*of.values()])) for name, of in values.items()}
    means["cadence"] = 60 / means["step_time_s"]
    stance = walking.value("mean_stance")
    known = {} if stance is None else {"stance": stance}
    for statement, (name, of) in _OF_WALKS.items():
        row = walking.figure(name)
        if row is not None and row.error is not None and np.isfinite(means[of]):
            yield Case(statement, row.value, means[of], SD_90 * row.error, known)


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


def movements(finished: Finished, take: Take) -> Iterator[Case]:
    """Peaks of repetitions that are true ones too, and means where each true one is found, and no other. Of static
    cameras, for nobody knows the true figures of others."""
    every = [(movement, names) for movement, groups in _MOVEMENTS.items() for names in groups]
    if not any(take.figures.group(*names).spans for _, names in every):
        return
    true = finished.captured().figures
    for movement, names in every:
        for figure, row, truth in same_rows(take.figures.group(*names), true.group(*names)):
            half = np.nan if row.error is None else SD_90 * row.error
            yield Case(f"{movement}: {figure}", row.value, truth.value, half)


def same_rows(found: Measures, true: Measures) -> Iterator[tuple[str, Measure, Measure]]:
    """(figure, row found, the true one) of the repetitions of one movement; a peak is that of the repetition that
    shares the most time with it."""
    spans, true_spans = (np.array(of.spans) for of in (found, true))
    if not len(spans) or not len(true_spans):
        return
    shared = np.minimum(spans[:, None, 1], true_spans[:, 1]) - np.maximum(spans[:, None, 0], true_spans[:, 0])
    true_peaks = {peak.number: peak for peak in true.repetitions("peak")}  # one that a gap hides has none
    for peak in found.repetitions("peak"):
        of = shared[peak.number or 0]
        if of.max() > 0 and int(of.argmax()) in true_peaks:
            yield "peak, deg", peak, true_peaks[int(of.argmax())]
    same = shared.max(axis=1).min() > 0 and np.array_equal(shared.argmax(axis=1), np.arange(len(true_spans)))
    for name, figure in _OF_MOVEMENTS.items():
        row, truth = found.figure(name), true.figure(name)
        if same and row is not None and truth is not None:
            yield figure, row, truth


class Ranged(NamedTuple):
    """An angle's range in degrees, found and true over the same frames. ends: the standard deviation that independent
    errors of its ends would give it; error: the stated one."""

    found: float
    true: float
    ends: float
    error: float


class Repeated(NamedTuple):
    """Two repetitions of an angle in a take: their peaks in degrees, found and true, their errors, and the stated
    minimal detectable change."""

    angle: str
    found: tuple[float, float]
    true: tuple[float, float]
    errors: tuple[float, float]
    mdc90: float


def true_angles(truth: SeenTake, rows: np.ndarray) -> dict[str, np.ndarray]:
    """{angle: (T,) degrees} of the truth at these rows (T,) of it, NaN where there is none."""
    joints = smoothed(truth.truth, truth.keypoints.times)
    series = take_angles(TakeJoints(truth.truth, joints, truth.R_camera_from_body))
    return {name: series[name].value_deg[rows] for name in ANGLES}


def within(take: Take, true: Mapping[str, np.ndarray]) -> Iterator[Case]:
    """Ranges of motion, right less left, and one repetition less another. true: (T,) of `true_angles`."""
    every = ranges(take, true)
    for both in dict.fromkeys(of_both(name) for name in every):
        of = [every[name] for name in (both, f"r_{both}", f"l_{both}") if name in every]
        for side in of:
            yield Case(f"range of {both}", side.found, side.true, SD_90 * side.error, {"found": side.found})
        index = take.figures.group("symmetry", both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            right, left = of
            size = (right.found + left.found) / 2  # an index in degrees, for that of small ranges has none
            off, true_off = right.found - left.found, right.true - left.true
            half = SD_90 * index.error / 100 * size
            yield Case(f"right less left range of {both}", off, true_off, half, {"found": size})
    for pair in repetitions(take, true):
        off = float(near(np.array(pair.found[0] - pair.found[1] - pair.true[0] + pair.true[1]), 0.0))
        yield Case("peak less peak", off, 0.0, pair.mdc90)


def ranges(take: Take, true: Mapping[str, np.ndarray]) -> dict[str, Ranged]:
    """{angle: Ranged} of those that state a range with its error; nothing where the truth lacks frames of it. true:
    (T,) of `true_angles`."""
    columns, every = take.kinematics or {}, {}
    for name in ANGLES:
        row = take.figures.group("range_of_motion", name).figure("p05_p95")
        if row is None or row.error is None:
            continue
        values, centre = continuous(columns[f"{name}_deg"], ANGLES[name].centre_deg), ANGLES[name].centre_deg
        visible = np.isfinite(values)
        beside = continuous(np.where(visible, true[name], np.nan), centre)
        if np.isfinite(beside).sum() >= _SEEN * visible.sum():
            _, sds = ends(values, columns[f"{name}_sd_deg"])
            (low, high), _ = ends(beside, np.full(len(beside), np.nan))
            every[name] = Ranged(row.value, high - low, float(np.hypot(*sds)), row.error)
    return every


def repetitions(take: Take, true: Mapping[str, np.ndarray]) -> Iterator[Repeated]:
    """Every two repetitions of an angle, each peak against the highest true value of that repetition. true: (T,) of
    `true_angles`."""
    times, measures = take.need("poses").times, take.figures
    groups = {angle: measures.group(*place.split(".")) for place, angle in _DRIVES.items()}
    groups |= measures.group("repetitions").groups
    for angle, group in groups.items():
        mdc90 = group.value("peak_mdc90")
        if mdc90 is None:
            continue
        at = [true[angle][(times >= start) & (times <= stop)] for start, stop in group.spans]
        peaks = [float(np.max(values)) if len(values) else np.nan for values in at]  # NaN where one is
        both = [(peak, peaks[peak.number or 0]) for peak in group.repetitions("peak")]
        for (row, first), (later, second) in combinations(both, 2):
            if np.isfinite(first + second) and row.error is not None and later.error is not None:
                errors = (row.error, later.error)
                yield Repeated(angle, (row.value, later.value), (first, second), errors, mdc90)
