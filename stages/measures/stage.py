"""Figures of a take: ranges of motion, symmetry, repetitions, walking, the floor, jumps and paths, each with its error
and what it rests on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...models.angle_error.joint_noise import made_by_the_built_in
from ...models.angle_error.repeatability import Between, difference_sd, ends, judged, middle_sd, range_sd
from ...models.gait.gait import Gait, separation
from ...models.gait.of_take import NOISE, SIDES, body_joints, gait_of
from ...models.place.airborne import Airborne, airborne
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import (
    Curve,
    Curves,
    Measure,
    Remark,
    Row,
    grouped,
    half_bar,
    measure,
    numbered,
    side_of,
    subgroup,
    within,
)
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.notices import notice, verdict
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.take import Take
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.signals.angles import ANGLES, MIDLINE, continuous, of_both, unwrapped
from ...pipeline.signals.filters import breaks, rate
from ...pipeline.signals.flights import Flight
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ...pipeline.signals.reprojection import residuals_of
from .cycles import Repetition, alike, hiding, near_ends_s, normalised, repetitions
from .figures import (
    FEWEST_FOR_SD,
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
from .jumps import absorbs, jumping, jumps
from .off_keypoints import off_keypoints
from .outcomes import never_looked_for, with_outcome
from .smoothness import path_length
from .strikes import strikes
from .walking import FEWEST, doubts, walking

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
# At the top of a movement: longer, and it is a posture that somebody holds. Squats of the labelled takes stay 0.3 to
# 1.5 s below, arms with a box over the head 3.5.
_HOLD_S = 3.0
_IN_BENDS = ("r_knee_flexion", "l_knee_flexion", "r_hip_flexion", "l_hip_flexion", "trunk_lean_sagittal")
_IN_RAISES = ("shoulder_elevation", "shoulder_flexion", "elbow_flexion")


@dataclass(frozen=True)
class Measures:
    """The stage. repeated: further angles whose repetitions are counted, such as "r_elbow_flexion". belt_speed: of a
    treadmill, in the take's unit of length a second (m/s); where it is not told, the feet that stand tell it, if the
    pelvis path is known. unusable: whether figures are made of poses that are unusable too."""

    repeated: tuple[str, ...] = ()
    belt_speed: float | None = None
    unusable: bool = False

    name: ClassVar[str] = "measures"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ("measures",)

    def __post_init__(self) -> None:
        for name in self.repeated:
            if name not in ALL_ANGLES:
                raise InputError(
                    "name-unknown", f"There is no angle '{name}' to count; {did_you_mean(name, ALL_ANGLES)}"
                )
        if self.belt_speed is not None and not 0 < self.belt_speed < np.inf:
            raise InputError(
                "bad-value",
                f"Expected a positive belt speed, got {self.belt_speed:g}; leave it out for a walk over the floor.",
            )

    def __call__(self, take: Take) -> Take:
        filtered, rectified, kinematics = (
            take.need("filtered"),
            take.need("rectified"),
            take.need("kinematics"),
        )
        if not self.unusable and verdict(take.judged) == "unusable":
            return take.with_(measures=()).saying(notice("figures-withheld"))
        gait = gait_of(body_joints(filtered, rectified), filtered, rectified, kinematics)
        source = take.need("poses")
        asked = airborne(take), self.repeated, self.belt_speed
        found = measures(filtered, rectified, kinematics, source, gait, *asked)
        found += tuple(within("off_keypoints", off_keypoints(residuals_of(take), source.times)))
        said = doubts(gait, source) if rectified.level_ok else []
        return take.with_(measures=found).saying(*said)


def measures(
    filtered: PoseSequence,
    rectified: Rectified,
    kinematics: dict[str, np.ndarray],
    source: PoseSequence,
    gait: Gait,
    flights: Airborne,
    repeated: Sequence[str] = (),
    belt_speed: float | None = None,
) -> tuple[Row, ...]:
    """Rows, named below as in summary.json (`pipeline.core.measures.nested`). What cannot be had is absent, and its
    group has a `reason`.

    filtered: joints in LEVEL after the low-pass; rectified: where BODY's axes are from; kinematics: columns (T,) with
    the angles (stages.angles.joint_angles) and paths (stages.trajectories.trajectory); source: the poses that
    were rectified; gait: models.gait.of_take's; flights: models.place.airborne's; belt_speed: of a treadmill.

    An `_error_` is one standard deviation of the figure beside it: of angles by what they are stated with; of ranges,
    of right less left and from repetition to repetition (peak_mdc90) by what these were off on lifted takes with truth
    (models/angle_error/repeatability.py), for other lifters the errors of two moments taken for independent; of means
    over repetitions by their spread, but by half of a frame's length at least; of gait figures by what they were off on
    walks with truth (models/gait/errors.py), and none for poses of lifters whose errors were not measured, nor for
    lengths and speeds of motion capture. Figures end at the first digit of their error.

    range_of_motion: of each angle; p05_p95_deg leaves the highest and lowest twentieth of the frames out, which are
        noise's, and sd_deg is the middle of the stated standard deviations. beyond_anatomy_frames: in how many frames
        the angle is one that no joint reaches (pipeline.signals.angles). symmetry: of the right and left p05_p95_deg.
    knee_bends: both knees bend and straighten together while the feet stay (sitting down on a seat and rising again
        counts too, landing does not); peak_deg is the less bent knee's; squats: how many reach 70 degrees. arm_raises:
        an arm goes up and down in whichever plane. repetitions: of the angles `repeated`. A repetition rises by 35
        (knees), 50 (arms) or 20 degrees at least, by half of the largest change in the take, and by more than noise
        makes: twice the standard deviation of a difference of two values. Means are of those that no gap cuts.
        holds: those that stay at the top for over 3 s, which no count or mean has.
        count_reason: when one more may have been where the angle is missing; `reason` where none was seen.
    walking: steps and strides between the feet's initial contacts (models/gait), in walks of three steps or more
        and runs of two, without turns; no `steps` where they could not be seen, and why. Cadence is a minute by the
        mean step time, of three strides of a walk and two of a run at least. Stance, swing and single support are
        shares of the stride, as is double support of a walk; a run has a flight time instead. Speed, lengths and width
        are there where the pelvis path is known or the belt's speed told, else `lengths_reason`.
    floor: height, slope along the walk and stairs by where the feet stand, where the pelvis path is known; of a belt
        the height, and `slope_reason`.
    jumps: flights in which the centre of mass falls freely, where the pelvis path is known (stages/measures/jumps.py).
    punches, kicks: fast movements of a limb, by side (stages/measures/strikes.py); they have no errors yet, and say so.
    sitting: nobody looks for it.
    paths: lengths from the pelvis, and of the pelvis (root) where its way is known.

    Each movement has an `outcome`: seen, none, cannot-be-told or not-looked-for, with a `reason` where one is known.
    `frames` is how many frames a figure rests on, `nan_share` the share of the take's frames that have no value.
    Smoothness (stages/measures/smoothness.py) is that of an angle's rate while it rises (up) and returns (down), the
    middle one of all repetitions. Cycles are curves of 101 points over 0 to 100 % of a repetition or stride, mean and
    standard deviation over those in which no frame is missing.
    """
    take = _Columns(kinematics, filtered.times, breaks(filtered), judged(source))
    body = body_joints(filtered, rectified)
    named = [name for name in ALL_ANGLES if name in ANGLES or f"{name}_deg" in kinematics]
    ranges = [row for name in named for row in within(name, _range(take, name), side_of(name))]
    on_demand = [
        row
        for name in repeated
        for row in within(name, _repeats(take, name, take(name), take.sd(name), _ANY, [name]), side_of(name))
    ]
    jumped, apart = jumping(flights, gait), separation(body, filtered.times, take.seams)[:, 0]
    walk = walking(body, gait, kinematics, take.cycles, filtered, rectified, source, belt_speed)
    return (
        *within("range_of_motion", ranges),
        *within("symmetry", _symmetry(take, ranges, named)),
        *within("knee_bends", with_outcome(_knee_bends(take, gait, jumped, apart))),
        *within("arm_raises", with_outcome(_arm_raises(take))),
        *strikes(filtered, rectified),
        *within("repetitions", on_demand),
        *within("walking", with_outcome(walk)),
        *within("floor", floor(walk, gait, filtered, rectified, made_by_the_built_in(source))),
        *within("jumps", with_outcome(jumps(flights, jumped, rectified), flights.looked)),
        *within("sitting", never_looked_for()),
        *within("paths", _paths(take, rectified)),
    )


@dataclass(frozen=True)
class _Columns:
    """The take's columns (T,) and its clock; an angle is NaN throughout where it is not among them. judged: whether the
    errors of its differences are known (repeatability.judged)."""

    columns: dict[str, np.ndarray]
    times: np.ndarray
    seams: tuple[int, ...]
    judged: bool

    def difference_sd(self, figure: str, errors: tuple[float, float], between: Between) -> float:
        """Of two figures, whose errors are independent where nothing is known of their difference."""
        return difference_sd(figure, errors, between) if self.judged else float(np.hypot(*errors))

    def __call__(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_deg", np.full(len(self.times), np.nan))

    def sd(self, angle: str) -> np.ndarray:
        return self.columns.get(f"{angle}_sd_deg", np.full(len(self.times), np.nan))

    def cycles(self, angle: str, spans: np.ndarray) -> Curve | None:
        """Mean and, of six or more, standard deviation of an angle over spans (N, 2) in seconds; None when none is
        whole."""
        curves = alike(
            normalised(unwrapped(self(angle)), self.times, spans, self.seams), ALL_ANGLES[angle].centre_deg
        )
        if not len(curves):
            return None
        sd = figures(curves.std(axis=0, ddof=1)) if len(curves) >= FEWEST_FOR_SD else None
        return Curve(angle, len(curves), figures(curves.mean(axis=0)), sd)


def _knee_bends(take: _Columns, gait: Gait, jumped: Sequence[Flight], apart: np.ndarray) -> list[Row]:
    """apart: (T,) how far the ankles are apart, in lengths of a leg."""

    def in_place(bend: Repetition) -> bool:
        walks = any(step.start_s < bend.stop_s and bend.start_s < step.stop_s for step in gait.steps)
        if walks or absorbs(jumped, bend.peak_s):
            return False
        meanwhile = apart[(take.times >= bend.start_s) & (take.times <= bend.stop_s)]
        meanwhile = meanwhile[np.isfinite(meanwhile)]
        return not len(meanwhile) or float(np.ptp(meanwhile)) <= _STAYS

    right, left = take("r_knee_flexion"), take("l_knee_flexion")
    sd = np.where(right < left, take.sd("r_knee_flexion"), take.sd("l_knee_flexion"))
    bends = _repeats(take, "knee_flexion", np.minimum(right, left), sd, _BEND, _IN_BENDS, in_place)
    if peaks := numbered(grouped(bends), "peak"):
        bends.append(Measure("squats", sum(peak.value >= _SQUAT for peak in peaks)))
    return bends


def _arm_raises(take: _Columns) -> list[Row]:
    rows: list[Row] = []
    curves: list[Curve] = []
    for words, side in SIDES.items():
        angle = f"{side}_shoulder_elevation"
        shown = [f"{side}_{part}" for part in _IN_RAISES]
        arm = _repeats(take, angle, take(angle), take.sd(angle), _RAISE, shown)
        curves += [curve for row in arm if isinstance(row, Curves) for curve in row.of]
        rows += within(words, [row for row in arm if not isinstance(row, Curves)], side_of(angle))
    return [*rows, *([Curves(tuple(curves))] if curves else [])]


def _range(take: _Columns, name: str) -> list[Row]:
    values = continuous(take(name), ALL_ANGLES[name].centre_deg)
    known = values[np.isfinite(values)]
    if len(known) < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have this angle"), *basis(values)]
    sd = take.sd(name)
    (low, high), (at_low, at_high) = ends(values, sd)
    error = float(np.hypot(at_low, at_high))
    if take.judged:
        error = range_sd(of_both(name), high - low, error)
    least, most = ALL_ANGLES[name].anatomy_deg
    beyond = int(((known < least) | (known > most)).sum())
    return [
        with_error("lowest", "deg", known.min(), at_low),
        with_error("highest", "deg", known.max(), at_high),
        Measure("full_range", rounded(known.max() - known.min(), error), "deg"),
        with_error("p05", "deg", low, at_low),
        with_error("p95", "deg", high, at_high),
        with_error("p05_p95", "deg", high - low, error),
        *([Measure("sd", figure_of_error(middle_sd(sd)), "deg")] if np.isfinite(sd).any() else []),
        *([Measure("beyond_anatomy_frames", beyond)] if beyond else []),
        *basis(values),
    ]


def _symmetry(take: _Columns, ranges: Sequence[Row], angles: Sequence[str]) -> list[Row]:
    """Of the rows of the ranges of these angles."""
    formula = (
        "100 (right - left) / ((right + left) / 2) of the ranges between the 5th and 95th percentile; "
        "positive when the right is larger"
    )
    by_angle = grouped(ranges)
    result: list[Row] = [Remark("formula", formula)]
    for name in dict.fromkeys(of_both(angle) for angle in angles if angle not in MIDLINE):
        right, left = (measure(subgroup(by_angle, f"{side}_{name}"), "p05_p95") for side in SIDES.values())
        if right is None or left is None:
            result += within(name, [Remark("reason", "one side has no range")])
            continue
        result += within(
            name,
            [
                Measure("right", right.value, "deg", side="right"),
                Measure("left", left.value, "deg", side="left"),
            ],
        )
        if max(right.value, left.value) < _NO_RANGE:
            result += within(name, [Remark("reason", f"both ranges are below {_NO_RANGE:g} degrees")])
        else:
            errors = (right.error or np.nan, left.error or np.nan)
            error = take.difference_sd(f"range_of_motion.{name}", errors, "sides")
            result += within(name, symmetry(right.value, left.value, error))
    return result


def _repeats(
    take: _Columns,
    angle: str,
    driver: np.ndarray,
    sd: np.ndarray,
    least: float,
    shown: Iterable[str],
    counts: Callable[[Repetition], bool] = lambda one: True,
) -> list[Row]:
    """Of the values (T,) of an angle that drives a movement, with their standard deviations (T,), and of those shown
    over the cycles of repetitions that count."""
    if np.isfinite(driver).sum() < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have the angle"), *basis(driver)]
    whole = float(np.nanmax(driver) - np.nanmin(driver))
    usual = middle_sd(sd)
    plain = max(least, _HALF * whole)
    least = max(plain, NOISE * usual if np.isfinite(usual) else 0.0)
    every = [one for one in repetitions(driver, take.times, least, take.seams) if counts(one)]
    holds = [one for one in every if one.held_s > _HOLD_S]
    found = [one for one in every if one.held_s <= _HOLD_S]
    if not every and least > plain and any(map(counts, repetitions(driver, take.times, plain, take.seams))):
        noise = f"changes by {whole:.0f} degrees, which its error may make (less than {least:.0f})"
        return [Measure("count", 0), Remark("reason", f"the angle {noise}"), *basis(driver)]
    whole_ones = [one for one in found if one.whole]
    briefest_s = _AS_LONG * min((one.stop_s - one.start_s for one in whole_ones or found), default=0.0)
    gaps = hiding(driver, take.times, least, take.seams, briefest_s, counts)
    unseen = "count_reason" if found else "reason"
    said = [Remark(unseen, f"not seen from {spans_in_words(gaps)}")] if gaps else []
    result: list[Row] = [Measure("count", len(found)), *said, *basis(driver), *_holds(holds)]
    if not found:
        return result
    result += [
        moments("start", (one.start_s for one in found)),
        moments("stop", (one.stop_s for one in found)),
        *_peaks(take, angle, found, sd),
    ]
    if not whole_ones:
        return result
    spans = np.array([(one.start_s, one.stop_s) for one in whole_ones])
    # Of a height above the valley, as of the whole rise. What a lifter has wrong of the posture in which a repetition
    # begins it has wrong of the same one at its end and in the next, so that all are too long, or all too short.
    height_sd = np.sqrt(2) * usual
    ends_s = float(np.mean([near_ends_s(driver, take.times, one, height_sd) for one in whole_ones]))
    durations_s, frames_s = spans[:, 1] - spans[:, 0], time_resolution(rate(take.times))
    rises = np.array([one.rise for one in whole_ones])
    curves = (take.cycles(name, spans) for name in shown)
    return [
        *result,
        *spread("duration", "s", durations_s, frames_s, shared=ends_s),
        *spread("rise", "deg", rises, shared=height_sd),
        *_smoothness(whole_ones),
        Curves(tuple(curve for curve in curves if curve)),
    ]


def _holds(held: Sequence[Repetition]) -> list[Row]:
    """Postures that are held: no repetitions of a movement, and in none of its means."""
    if not held:
        return []
    times: list[Row] = [
        moments("start", (one.start_s for one in held)),
        moments("stop", (one.stop_s for one in held)),
    ]
    longest = max(one.held_s for one in held)
    return within("holds", [Measure("count", len(held)), *times, Measure("longest", figure(longest), "s")])


def _peaks(take: _Columns, angle: str, found: Sequence[Repetition], sd: np.ndarray) -> list[Measure]:
    """With their errors, if all have one, and then the minimal detectable change from one to another."""
    errors = [float(sd[np.searchsorted(take.times, one.peak_s)]) for one in found]
    peaks = [with_error("peak", "deg", one.peak, error) for one, error in zip(found, errors, strict=True)]
    known = bool(np.isfinite(errors).all())
    usual = middle_sd(np.array(errors))
    mdc90 = half_bar(take.difference_sd(f"peak.{of_both(angle)}", (usual, usual), "repetitions"))
    return [
        *(replace(one, number=i, error=one.error if known else None) for i, one in enumerate(peaks)),
        *([Measure("peak_mdc90", mdc90, "deg")] if known and len(peaks) > 1 else []),
    ]


def _smoothness(found: list[Repetition]) -> list[Measure]:
    result: list[Measure] = []
    for way in ("up", "down"):
        for i, name in enumerate(("sparc", "log_dimensionless_jerk")):
            values = np.array([getattr(one, way)[i] for one in found])
            result += middle(f"{name}_{way}", values[np.isfinite(values)])
    return result


def _paths(take: _Columns, rectified: Rectified) -> list[Row]:
    if rectified.camera == "moving":
        why = "the camera moves, and its turning about the vertical would be part of the way"
        return [Remark("reason", why)]
    result: list[Row] = []
    for column in take.columns:
        joint = column.removesuffix("_x")
        axes = [f"{joint}_{axis}" for axis in "xyz"]
        if joint == column or not set(axes) <= set(take.columns):
            continue
        points = np.stack([take.columns[axis] for axis in axes], axis=-1)
        length, duration = path_length(points, take.times, take.seams)
        rests_on = basis(points.sum(axis=-1))
        if duration == 0:
            why = "no two frames in a row have this joint"
            result += within(joint, [Remark("reason", why), *rests_on], side_of(joint))
            continue
        way = [
            Measure("path_length", figure(length), "length"),
            Measure("mean_speed", figure(length / duration), "speed"),
            Measure("duration", figure(duration), "s"),
        ]
        result += within(joint, [*way, *rests_on], side_of(joint))
    return result or [Remark("reason", "no paths were written; run trajectories first")]
