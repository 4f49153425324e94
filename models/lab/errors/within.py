"""What a finished take states of differences within it, each with the truth: ranges of motion, right less left, and one
repetition less another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....pipeline.core.measures import Measure
from ....pipeline.core.take import Take
from ....pipeline.signals.angles import ANGLES, MIDLINE, continuous, near, of_both
from ...angle_error.repeatability import ends
from ...angle_error.take_angles import TakeJoints, smoothed, take_angles
from ...common.metrics import SD_90
from ..evaluation.testbed import SeenTake
from .judge import Stated

_SEEN = 0.95  # of the frames of a found range, whose truth is known
_DRIVES = {"arm_raises.right": "r_shoulder_elevation", "arm_raises.left": "l_shoulder_elevation"}


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
    filtered = smoothed(truth.truth, truth.keypoints.times)
    found = take_angles(TakeJoints(truth.truth, filtered, truth.R_camera_from_body))
    return {name: found[name].value_deg[rows] for name in ANGLES}


def ranges(take: Take, true: Mapping[str, np.ndarray]) -> dict[str, Ranged]:
    """{angle: Ranged} of those that state a range with its error; nothing where the truth lacks frames of it. true:
    (T,) of `true_angles`."""
    measures, columns, found = take.figures, take.kinematics or {}, {}
    for name in ANGLES:
        row = measures.group("range_of_motion", name).figure("p05_p95")
        if row is None or row.error is None:
            continue
        values, centre = continuous(columns[f"{name}_deg"], ANGLES[name].centre_deg), ANGLES[name].centre_deg
        seen = np.isfinite(values)
        beside = continuous(np.where(seen, true[name], np.nan), centre)
        if np.isfinite(beside).sum() >= _SEEN * seen.sum():
            _, sds = ends(values, columns[f"{name}_sd_deg"])
            (low, high), _ = ends(beside, np.full(len(beside), np.nan))
            found[name] = Ranged(row.value, high - low, float(np.hypot(*sds)), row.error)
    return found


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
        both: list[tuple[Measure, float]] = [
            (peak, peaks[peak.number or 0]) for peak in group.repetitions("peak")
        ]
        for (one, first), (other, second) in combinations(both, 2):
            if np.isfinite(first + second) and one.error is not None and other.error is not None:
                errors = (one.error, other.error)
                yield Repeated(angle, (one.value, other.value), (first, second), errors, mdc90)


def within(take: Take, truth: SeenTake, rows: np.ndarray) -> Iterator[Stated]:
    """What is judged of them. rows: (T,) of the truth that the take has."""
    true = true_angles(truth, rows)
    found, symmetry = ranges(take, true), take.figures.group("symmetry")
    for both in dict.fromkeys(of_both(name) for name in found):
        of = [found[name] for name in (both, f"r_{both}", f"l_{both}") if name in found]
        errors = np.array([one.found - one.true for one in of])
        known = {"found": np.array([one.found for one in of])}
        half = SD_90 * np.array([one.error for one in of])
        yield Stated(f"range of {both}", truth.subject, errors, half, known)
        index = symmetry.group(both).figure("symmetry_index")
        if both not in MIDLINE and len(of) == 2 and index is not None and index.error is not None:
            mean = (of[0].found + of[1].found) / 2  # an index in degrees, for that of small ranges has none
            off = of[0].found - of[1].found - (of[0].true - of[1].true)
            half = np.array([SD_90 * index.error / 100 * mean])
            known = {"found": np.array([mean])}
            yield Stated(f"right less left range of {both}", truth.subject, np.array([off]), half, known)
    pairs = [*repetitions(take, true)]
    if pairs:
        off = near(np.array([p.found[0] - p.found[1] - p.true[0] + p.true[1] for p in pairs]), 0.0)
        yield Stated("peak less peak", truth.subject, off, np.array([p.mdc90 for p in pairs]))
