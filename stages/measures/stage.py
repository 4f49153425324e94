"""Figures of a take: ranges of motion, symmetry, repetitions, walking, the floor, jumps and paths, each with its error
and what it rests on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...models.gait.gait import separation
from ...models.gait.of_take import NOISE, SIDES, body_joints, gait_of
from ...pipeline.core.errors import InputError
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.take import Take
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.signals.angles import ANGLES, MIDLINE, near, of_both, unwrapped
from ...pipeline.signals.filters import breaks, rate
from ...pipeline.signals.foot_angles import ALL_ANGLES
from .cycles import (
    Repetition,
    alike,
    hiding,
    near_ends_s,
    normalised,
    repetitions,
    symmetry_error,
)
from .figures import (
    basis,
    figure,
    figure_of_error,
    figures,
    middle,
    moments,
    rounded,
    spread,
    symmetry,
    time_resolution,
    with_error,
)
from .floor import floor
from .jumps import jumps
from .smoothness import path_length
from .walking import FEWEST, walking

_NO_RANGE = 5.0  # degrees: below, noise makes the range, and a share of it says nothing
_BEND, _RAISE, _ANY = 35.0, 50.0, 20.0  # degrees that a repetition rises by at least
# Degrees of knee flexion from which a knee bend is a squat: a half squat is 70 to 100, a deep one more (Schoenfeld,
# J Strength Cond Res 24(12), 2010, "Squatting kinematics and kinetics"); less is a partial one, or a duck.
_SQUAT = 70.0
_STAYS = (
    0.4  # legs: by how much it changes in a knee bend at most; in walking both knees bend at every landing
)
_HALF = 0.5  # and both by this part of the largest change in the take
# Of the briefest repetition, for nobody repeats a movement to the frame: a gap that leaves room for a briefer one hides
# none. Of 63 series of lifted squats and raises this tells the seven that a gap made one short, and no other.
_AS_LONG = 0.8
_IN_BENDS = ("r_knee_flexion", "l_knee_flexion", "r_hip_flexion", "l_hip_flexion", "trunk_lean_sagittal")
_IN_RAISES = ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")


@dataclass(frozen=True)
class Measures:
    """The stage. repeated: further angles whose repetitions are counted, such as "r_elbow_flexion". belt_speed: of a
    treadmill, in the take's unit of length a second (m/s); where it is not told, the feet that stand tell it, if the
    pelvis path is known."""

    repeated: tuple[str, ...] = ()
    belt_speed: float | None = None

    name: ClassVar[str] = "measures"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ("measures",)

    def __post_init__(self) -> None:
        for name in self.repeated:
            if name not in ALL_ANGLES:
                raise InputError(f"There is no angle '{name}' to count; {did_you_mean(name, ALL_ANGLES)}")
        if self.belt_speed is not None and not 0 < self.belt_speed < np.inf:
            raise InputError(
                f"Expected a positive belt speed, got {self.belt_speed:g}; leave it out for a walk over the floor."
            )

    def __call__(self, take: Take) -> Take:
        found = measures(
            take.need("filtered"),
            take.need("rectified"),
            take.need("kinematics"),
            take.need("poses"),
            self.repeated,
            self.belt_speed,
        )
        return take.with_(measures=found)


def measures(
    filtered: PoseSequence,
    rectified: Rectified,
    kinematics: dict[str, np.ndarray],
    source: PoseSequence,
    repeated: Sequence[str] = (),
    belt_speed: float | None = None,
) -> dict[str, Any]:
    """Nested figures, ready for JSON. Units are in the keys; lengths and speeds have none there, for theirs is the
    poses', metres or arbitrary. What cannot be had is absent, and its group has a `reason`.

    filtered: joints in LEVEL after the low-pass; rectified: where BODY's axes are from; kinematics: columns (T,) with
    the angles (stages.angles.joint_angles) and paths (stages.trajectories.trajectory); source: the poses that
    were rectified; belt_speed: of a treadmill.

    An `_error_` is one standard deviation of the figure beside it: of angles by what they are stated with, the errors
    of two moments taken for independent; of means over repetitions by their spread, but by half of a frame's length at
    least; of gait figures by what they were off on lifted walks with truth (models/gait/errors.py), and of lengths and
    speeds that no lifter has had a part in, none. Figures end at the first digit of their error.

    range_of_motion: of each angle; p05_p95_deg leaves the highest and lowest twentieth of the frames out, which are
        noise's, and sd_deg is the middle of the stated standard deviations. beyond_anatomy_frames: in how many frames
        the angle is one that no joint reaches (pipeline.signals.angles). symmetry: of the right and left p05_p95_deg.
    knee_bends: both knees bend and straighten together while the feet stay (sitting down on a seat and rising again
        counts too); peak_deg is the less bent knee's; squats: how many reach 70 degrees. arm_raises: an arm goes up
        and down in whichever plane. repetitions: of the angles `repeated`. A repetition rises by 35 (knees), 50 (arms)
        or 20 degrees at least, by half of the largest change in the take, and by more than noise makes: twice the
        standard deviation of a difference of two values. Means are of those that no gap cuts. count_reason: when the
        angle is missing where one more may have been, so that `count` is the least; `reason` where none was seen.
    walking: steps and strides between the feet's initial contacts (models/gait), in walks of three steps or more
        and runs of two, without turns; no `steps` where they could not be seen, and why. Cadence is a minute by the
        mean step time, of three strides of a walk and two of a run at least. Stance, swing and single support are
        shares of the stride, as is double support of a walk; a run has a flight time instead. Speed, lengths and width
        are there where the pelvis path is known or the belt's speed told, else `lengths_reason`.
    floor: height, slope along the walk and stairs by where the feet stand, where the pelvis path is known; of a belt
        the height, and `slope_reason`.
    jumps: flights in which the centre of mass falls freely, where the source knows the pelvis path.
    paths: lengths from the pelvis, and of the pelvis (root) where its way is known.

    `frames` is how many frames a figure rests on, `nan_share` the share of the take's frames that have no value.
    Smoothness (stages/measures/smoothness.py) is that of an angle's rate while it rises (up) and returns (down), the
    middle one of all repetitions. Cycles are curves of 101 points over 0 to 100 % of a repetition or stride, mean and
    standard deviation over those in which no frame is missing.
    """
    times, seams = filtered.times, breaks(filtered)
    take = _Columns(kinematics, times, seams)
    body = body_joints(filtered, rectified)
    gait = gait_of(body, filtered, rectified, kinematics)
    apart = separation(body)[:, 0]

    def in_place(one: Repetition) -> bool:
        if any(step.start_s < one.stop_s and one.start_s < step.stop_s for step in gait.steps):
            return False
        meanwhile = apart[(times >= one.start_s) & (times <= one.stop_s)]
        meanwhile = meanwhile[np.isfinite(meanwhile)]
        return not len(meanwhile) or float(np.ptp(meanwhile)) <= _STAYS

    named = [name for name in ALL_ANGLES if name in ANGLES or f"{name}_deg" in kinematics]
    ranges = {name: _range(take, name) for name in named}
    right, left = take("r_knee_flexion"), take("l_knee_flexion")
    knees = np.minimum(right, left)
    knees_sd = np.where(right < left, take.sd("r_knee_flexion"), take.sd("l_knee_flexion"))
    bends = _repeats(take, knees, knees_sd, _BEND, _IN_BENDS, in_place)
    if "peak_deg" in bends:
        bends["squats"] = sum(peak >= _SQUAT for peak in bends["peak_deg"])
    result: dict[str, Any] = {
        "range_of_motion": ranges,
        "symmetry": _symmetry(ranges),
        "knee_bends": bends,
    }
    arms = {
        words: _repeats(
            take,
            take(f"{side}_shoulder_elevation"),
            take.sd(f"{side}_shoulder_elevation"),
            _RAISE,
            [f"{side}_{part}" for part in _IN_RAISES],
        )
        for words, side in SIDES.items()
    }
    cycles = {name: curve for arm in arms.values() for name, curve in arm.pop("cycles", {}).items()}
    result["arm_raises"] = {**arms, "cycles": cycles} if cycles else arms
    if repeated:
        result["repetitions"] = {
            name: _repeats(take, take(name), take.sd(name), _ANY, [name]) for name in repeated
        }
    result["walking"] = walking(body, gait, kinematics, take.cycles, filtered, rectified, source, belt_speed)
    result["floor"] = floor(result["walking"], gait, filtered, rectified)
    result["jumps"] = jumps(rectified, gait)
    result["paths"] = _paths(take, rectified)
    return result


@dataclass(frozen=True)
class _Columns:
    """The take's columns (T,) and its clock; an angle is NaN throughout where it is not among them."""

    columns: dict[str, np.ndarray]
    times: np.ndarray
    seams: tuple[int, ...]

    def __call__(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_deg", np.full(len(self.times), np.nan))

    def sd(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_sd_deg", np.full(len(self.times), np.nan))

    def continuous(self, angle: str) -> np.ndarray:
        """An angle without steps from one end of its range to the other, about the middle of that range; as it is where
        it turns all the way round."""
        values = unwrapped(self(angle))
        known = values[np.isfinite(values)]
        if not len(known) or np.ptp(known) > 360:
            return self(angle)
        middle = (known.min() + known.max()) / 2
        return values + near(middle, ALL_ANGLES[angle].centre_deg) - middle

    def cycles(self, angle: str, spans: np.ndarray) -> dict[str, Any]:
        """Mean and standard deviation of an angle over spans (N, 2) in seconds; empty when none is whole."""
        curves = alike(
            normalised(unwrapped(self(angle)), self.times, spans, self.seams), ALL_ANGLES[angle].centre_deg
        )
        if not len(curves):
            return {}
        spread = {"sd_deg": figures(curves.std(axis=0, ddof=1))} if len(curves) > 1 else {}
        return {"count": len(curves), "mean_deg": figures(curves.mean(axis=0)), **spread}


def _range(take: _Columns, name: str) -> dict[str, Any]:
    values = take.continuous(name)
    known = values[np.isfinite(values)]
    if len(known) < FEWEST:
        return {"reason": f"fewer than {FEWEST} frames have this angle", **basis(values)}
    low, high = np.percentile(known, [5, 95])
    sd = take.sd(name)
    at_low, at_high = _middle_sd(sd[values <= low]), _middle_sd(sd[values >= high])
    error = float(np.hypot(at_low, at_high))
    least, most = ALL_ANGLES[name].anatomy_deg
    beyond = int(((known < least) | (known > most)).sum())
    return {
        "lowest_deg": rounded(known.min(), at_low),
        "highest_deg": rounded(known.max(), at_high),
        "full_range_deg": rounded(known.max() - known.min(), error),
        "p05_deg": rounded(low, at_low),
        "p95_deg": rounded(high, at_high),
        **with_error("p05_p95_deg", high - low, error),
        **({"sd_deg": figure_of_error(_middle_sd(sd))} if np.isfinite(sd).any() else {}),
        **({"beyond_anatomy_frames": beyond} if beyond else {}),
        **basis(values),
    }


def _middle_sd(sd: np.ndarray) -> float:
    known = sd[np.isfinite(sd)]
    return float(np.median(known)) if len(known) else float("nan")


def _symmetry(ranges: dict[str, dict[str, Any]]) -> dict[str, Any]:
    formula = (
        "100 (right - left) / ((right + left) / 2) of the ranges between the 5th and 95th percentile; "
        "positive when the right is larger"
    )
    result: dict[str, Any] = {"formula": formula}
    for name in dict.fromkeys(of_both(angle) for angle in ranges if angle not in MIDLINE):
        sides = [ranges[f"{side}_{name}"] for side in SIDES.values()]
        if any("p05_p95_deg" not in side for side in sides):
            result[name] = {"reason": "one side has no range"}
            continue
        right, left = ((side["p05_p95_deg"], side.get("p05_p95_error_deg", np.nan)) for side in sides)
        result[name] = {"right_deg": right[0], "left_deg": left[0]}
        if max(right[0], left[0]) < _NO_RANGE:
            result[name]["reason"] = f"both ranges are below {_NO_RANGE:g} degrees"
        else:
            error = symmetry_error(right[0], left[0], right[1], left[1])
            result[name] |= symmetry(right[0], left[0], error)
    return result


def _repeats(
    take: _Columns,
    driver: np.ndarray,
    sd: np.ndarray,
    least: float,
    shown: Iterable[str],
    counts: Callable[[Repetition], bool] = lambda one: True,
) -> dict[str, Any]:
    """Of an angle (T,) that drives a movement, with its standard deviation (T,), and of those shown over the cycles of
    repetitions that count."""
    if np.isfinite(driver).sum() < FEWEST:
        return {"reason": f"fewer than {FEWEST} frames have the angle", **basis(driver)}
    whole = float(np.nanmax(driver) - np.nanmin(driver))
    usual = _middle_sd(sd)
    least = max(least, _HALF * whole, NOISE * usual if np.isfinite(usual) else 0.0)
    found = [one for one in repetitions(driver, take.times, least, take.seams) if counts(one)]
    whole_ones = [one for one in found if one.whole]
    briefest_s = _AS_LONG * min((one.stop_s - one.start_s for one in whole_ones or found), default=0.0)
    gaps = hiding(driver, take.times, least, take.seams, briefest_s, counts)
    said = {"count_reason" if found else "reason": f"not seen from {spans_in_words(gaps)}"} if gaps else {}
    result: dict[str, Any] = {"count": len(found), **said, **basis(driver)}
    if not found:
        return result
    result |= {
        "start_s": moments(one.start_s for one in found),
        "stop_s": moments(one.stop_s for one in found),
        **_peaks(take, found, sd),
    }
    if not whole_ones:
        return result
    spans = np.array([(one.start_s, one.stop_s) for one in whole_ones])
    # Of a height above the valley, as of the whole rise. What a lifter has wrong of the posture in which a repetition
    # begins it has wrong of the same one at its end and in the next, so that all are too long, or all too short.
    height_sd = np.sqrt(2) * usual
    ends_s = float(np.mean([near_ends_s(driver, take.times, one, height_sd) for one in whole_ones]))
    durations_s, frames_s = spans[:, 1] - spans[:, 0], time_resolution(rate(take.times))
    result |= {
        **spread("duration_s", durations_s, frames_s, shared=ends_s),
        **spread("rise_deg", np.array([one.rise for one in whole_ones]), shared=height_sd),
        **_smoothness(whole_ones),
    }
    cycles = {name: take.cycles(name, spans) for name in shown}
    return {**result, "cycles": {name: curve for name, curve in cycles.items() if curve}}


def _peaks(take: _Columns, found: Sequence[Repetition], sd: np.ndarray) -> dict[str, list[float]]:
    errors = [float(sd[np.searchsorted(take.times, one.peak_s)]) for one in found]
    peaks = {"peak_deg": [rounded(one.peak, error) for one, error in zip(found, errors, strict=True)]}
    if np.isfinite(errors).all():
        peaks["peak_error_deg"] = [figure_of_error(error) for error in errors]
    return peaks


def _smoothness(found: list[Repetition]) -> dict[str, float]:
    result: dict[str, float] = {}
    for way in ("up", "down"):
        for i, name in enumerate(("sparc", "log_dimensionless_jerk")):
            values = np.array([getattr(one, way)[i] for one in found])
            result |= middle(f"{name}_{way}", values[np.isfinite(values)])
    return result


def _paths(take: _Columns, rectified: Rectified) -> dict[str, Any]:
    if rectified.camera == "moving":
        return {"reason": "the camera moves, and its turning about the vertical would be part of the way"}
    result: dict[str, Any] = {}
    for column in take.columns:
        joint = column.removesuffix("_x")
        axes = [f"{joint}_{axis}" for axis in "xyz"]
        if joint == column or not set(axes) <= set(take.columns):
            continue
        points = np.stack([take.columns[axis] for axis in axes], axis=-1)
        length, duration = path_length(points, take.times, take.seams)
        rests_on = basis(points.sum(axis=-1))
        if duration == 0:
            result[joint] = {"reason": "no two frames in a row have this joint", **rests_on}
            continue
        result[joint] = {
            "path_length": figure(length),
            "mean_speed": figure(length / duration),
            "duration_s": figure(duration),
            **rests_on,
        }
    return result or {"reason": "no paths were written; run trajectories first"}
