"""Every figure that a finished take's measures state, joined with what is true of it.

The run's rows name the figure and its error. What is true comes from the bed: the captured feet for walks, the captured
flights for jumps (jumps.py), the same rows of a run on the captured joints for repeated movements, and the true angles
over the same frames for ranges of motion and for repetitions of an angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....pipeline.core.measures import SD_90, Measure, Measures
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, MIDLINE, continuous, near, of_both
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import TakeJoints, smoothed, take_angles
from .gait import true_gait, walks
from .judge import Case, Stated, of_cases
from .jumps import compared
from .runs import Finished
from .testbed import SeenTake

_SEEN = 0.95  # of the frames of a found range, whose truth is known
# Of walks, by the names of gait.walks.
_OF_WALKS = {
    "stance, %": "stance_percent",
    "double support, %": "double_support_percent",
    "single support, %": "single_support_percent",
    "step time, s": "step_time_s",
    "step length, m": "step_length",
    "walking speed, m/s": "walking_speed",
    "cadence, steps/min": "cadence",
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
        of_walks = {case.statement: case for case in walks(take, truth, true_gait(truth))}
        found = {statement: of_walks.get(name) for statement, name in _OF_WALKS.items()}
        cases += [
            case._replace(statement=statement)
            for statement, case in found.items()
            if case is not None and np.isfinite(case.half)
        ]
    if lifted and static:
        cases += movements(finished, take)
    if lifted and take.kinematics:
        cases += within(take, true_angles(truth, take.need("poses").frame_index))
    yield from of_cases(cases, truth.subject)


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
            yield Case(f"range of {both}", side.found, side.true, SD_90 * side.error)
        index = take.figures.group("symmetry", both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            right, left = of
            size = (right.found + left.found) / 2  # an index in degrees, for that of small ranges has none
            off, true_off = right.found - left.found, right.true - left.true
            half = SD_90 * index.error / 100 * size
            yield Case(f"right less left range of {both}", off, true_off, half)
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
