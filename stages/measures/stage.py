"""Figures of a take: ranges of motion, symmetry, repetitions, walking, the floor, jumps and paths, each with its error
and what it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from ...models.angle_error.repeatability import ends, judged, known_median
from ...models.gait.errors import own_covariance
from ...models.gait.gait import Gait, separation
from ...models.gait.of_take import body_joints, gait_of, unjudged
from ...models.place.airborne import Airborne, airborne
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import SD_90, Measure, Remark, Row, grouped, side_of, subgroup, within
from ...pipeline.core.notices import notice, verdict
from ...pipeline.core.pose import PoseSequence, Rectified
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.signals.angles import ANGLES, EXCHANGED, UNDEFINED, UNTRUSTED, continuous
from ...pipeline.signals.filters import breaks, runs
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ...pipeline.signals.norms import cannot_be_told
from ...pipeline.signals.reprojection import residuals_of, unsure_joints
from .columns import Columns
from .figures import basis, with_error
from .jumps import cut_jumps, jumping, jumps, unsure_hops, without_leaps, without_slips
from .movements import arm_raises, knee_bends
from .off_keypoints import Spans, exchanged, not_shown, off_keypoints
from .outcomes import BRIEFEST_S, NO_DOUBTS, UNSURE, Doubts, doubts_of, with_outcome
from .repeats import repeats
from .sides import ranges_compared, sides_untold, steps_compared
from .upright import leans
from .walking import FEWEST, doubts, walking

_OUTERMOST = 0.05  # of the frames: what the 5th to the 95th percentile leaves out at either end
_ANY, _SHARE = 20.0, 0.5  # degrees that a repetition rises by at least, and of the largest change in the take
# Standard deviation of an angle by a lifter whose errors were not measured: that of the built-in one, median of lifted
# validation takes (knees 8.4, arms 6.3, elbows 10).
_UNSTATED_DEG = 8.0
_UNTOLD = "the error is larger than the motion"
_UNSHOWN = {
    UNDEFINED: "are near its axis",
    UNTRUSTED: "are too uncertain",
    EXCHANGED: "have limbs that may be exchanged",
}


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
        residuals = residuals_of(take)
        unsure = unsure_joints(take)
        asked = (
            airborne(take),
            self.repeated,
            self.belt_speed,
            doubts_of(take.said, unsure),
        )
        against = not_shown(take, residuals)
        untold = sides_untold(take)
        found = measures(
            filtered,
            rectified,
            kinematics,
            source,
            gait,
            *asked,
            against,
            untold,
            unsure,
            take.told.neutral is None,
        )
        found += tuple(within("off_keypoints", off_keypoints(residuals, source.times)))
        said = exchanged(take, residuals)
        said += [notice("on-a-belt")] * (
            self.belt_speed is None and "belt" in subgroup(grouped(found), "walking")
        )
        said += doubts(gait, source) if rectified.level_ok else []
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
    doubt: Doubts = NO_DOUBTS,
    against: Mapping[str, Spans] = MappingProxyType({}),
    untold: Mapping[str, str] = MappingProxyType({}),
    unsure: Mapping[str, np.ndarray] = MappingProxyType({}),
    own_zero: bool = True,
) -> tuple[Row, ...]:
    """Rows, named below as in summary.json (`pipeline.core.measures.nested`). What cannot be had is absent, and its
    group has a `reason`.

    filtered: joints in LEVEL after the low-pass; rectified: where BODY's axes are from; kinematics: columns (T,) with
    the angles (stages.angles.Angles) and paths (stages.trajectories.trajectory); source: the poses that
    were rectified; gait: models.gait.of_take's; flights: models.place.airborne's; belt_speed: of a treadmill; doubt:
    of outcomes.doubts_of; against: of off_keypoints.not_shown; untold: of sides.sides_untold; unsure: of
    signals.reprojection.unsure_joints, whose frames are in no range; own_zero: of `_range`.

    Groups and figures are defined in docs/movements.md. An `_error_` is one standard deviation of the figure beside it:
    of angles by what they are stated with; of ranges, of right less left and from repetition to repetition (peak_mdc90)
    by what these were off on lifted takes with truth (models/angle_error/repeatability.py), for other lifters the
    errors of two moments taken for independent; of means over repetitions by their spread, but by half of a frame's
    length at least, none where what all share is unknown; of gait figures by what they were off on walks with truth
    (models/gait/errors.py), and none for lifters whose errors were not measured, nor for captured lengths and speeds.
    """
    guessed = unjudged(filtered, rectified)
    unstated_deg = _UNSTATED_DEG if guessed else 0.0
    take = Columns(kinematics, filtered.times, breaks(filtered), judged(source), unstated_deg)
    body = body_joints(filtered, rectified)
    named = [name for name in ALL_ANGLES if name in ANGLES or f"{name}_deg" in kinematics]
    ranges = [
        row for name in named for row in within(name, _range(take, name, own_zero, unsure), side_of(name))
    ]
    on_demand = [
        row
        for name in repeated
        for row in within(
            name, repeats(take, name, take(name), take.sd(name), _ANY, [name], share=_SHARE), side_of(name)
        )
    ]
    flights = without_slips(flights, against)
    jumped, apart = jumping(flights, gait), separation(body, filtered.times, take.seams)[:, 0]
    cut, hops = cut_jumps(flights, gait), unsure_hops(flights, gait)
    gait = without_leaps(gait, jumped)
    walk = walking(body, gait, kinematics, take.cycles, filtered, rectified, source, belt_speed, jumped)
    lasts_s = float(filtered.times[-1] - filtered.times[0]) if len(filtered) else 0.0
    steps_told = lasts_s >= BRIEFEST_S["walking"] and "steps" in grouped(walk)
    lean = leans(filtered) if rectified.level_ok else None
    bends, landings = knee_bends(take, gait, jumped, flights.ankle, apart, steps_told, against, lean)
    leaps = jumps(flights, jumped, cut, hops, rectified, landings)
    movements = {
        "knee_bends": bends,
        "arm_raises": arm_raises(take, against, lean),
        "walking": steps_compared(walk, untold),
    }
    return (
        *within("range_of_motion", ranges),
        *within("symmetry", ranges_compared(take, ranges, named, lasts_s, untold)),
        *(
            row
            for name, of in movements.items()
            for row in within(name, with_outcome(name, of, lasts_s, doubt=doubt))
        ),
        *within("repetitions", on_demand),
        *within("jumps", with_outcome("jumps", leaps, lasts_s, flights.looked, doubt)),
        *within("paths", _paths(take, filtered, rectified)),
    )


def _range(take: Columns, name: str, own_zero: bool, unsure: Mapping[str, np.ndarray]) -> list[Row]:
    """By the frames in which the detector is sure of the angle's joints; none where the others may have shown more.
    own_zero: the angle is 0 where docs/angles.md says, not in somebody's neutral posture: then anatomy limits it."""
    every = continuous(take(name), ALL_ANGLES[name].centre_deg)
    joints = ANGLES[name].joints if name in ANGLES else ()
    guessed = np.any([unsure[joint] for joint in joints if joint in unsure] or [[False]], axis=0)
    values = np.where(guessed, np.nan, every)
    known = values[np.isfinite(values)]
    share = f"the detector is unsure of its joints in {100 * guessed.mean():.0f} % of the frames"
    if guessed.mean() > UNSURE:
        return [Remark("reason", share), *basis(values)]
    if len(known) < FEWEST:
        return [Remark("reason", f"fewer than {FEWEST} frames have this angle"), *basis(values)]
    sd = take.sd(name)
    lifted = bool(take.unstated_deg) or np.isfinite(sd).any()
    if lifted and sum((untold := take.untold(name)).values()) > _OUTERMOST:
        # A lift's frames near the axis are the outermost, of an arm raised sideways; which they are differs by camera.
        parts = [f"{100 * part:.0f} % {_UNSHOWN[code]}" for code, part in untold.items() if part >= 0.005]
        why = f"of the frames {', '.join(parts)}; the others do not show its range"
        return [Remark("reason", why), *basis(values)]
    (low, high), (at_low, at_high) = ends(values, sd)
    lowest, highest = np.percentile(every[np.isfinite(every)], [5, 95])
    error = SD_90 * float(np.nanmax([at_low, at_high, take.unstated_deg]))
    if guessed.any() and max(low - lowest, highest - high) > error:
        return [Remark("reason", f"{share}; the others do not show its range"), *basis(values)]
    least, most = ALL_ANGLES[name].anatomy_deg
    beyond = int(((known < least) | (known > most)).sum()) if own_zero else 0
    return [
        with_error("lowest", "deg", known.min(), at_low),
        with_error("highest", "deg", known.max(), at_high),
        Measure("full_range", float(known.max() - known.min()), "deg"),
        with_error("p05", "deg", low, at_low),
        with_error("p95", "deg", high, at_high),
        with_error("p05_p95", "deg", high - low, take.range_sd(name, high - low, (at_low, at_high))),
        *([Measure("usual_error", known_median(sd), "deg")] if np.isfinite(sd).any() else []),
        *([Measure("beyond_anatomy_frames", beyond)] if beyond else []),
        *basis(values),
    ]


def _paths(take: Columns, filtered: PoseSequence, rectified: Rectified) -> list[Row]:
    """Lengths and mean speeds; none of a joint whose error is larger than its motion, which is then the error's."""
    if rectified.camera == "moving":
        why = "the camera moves, and its turning about the vertical would add to the path"
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
        if cannot_be_told(take.columns, f"{joint}_speed") or (
            joint == "root" and _rests(filtered, rectified)
        ):
            result += within(joint, [Remark("reason", _UNTOLD), *rests_on], side_of(joint))
            continue
        way = [
            Measure("path_length", float(length), "length"),
            Measure("mean_speed", float(length / duration), "speed"),
            Measure("duration", float(duration), "s"),
        ]
        result += within(joint, [*way, *rests_on], side_of(joint))
    return result or [Remark("reason", "no paths were written; run trajectories first")]


def path_length(points: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> tuple[float, float]:
    """How far points (T, D) go inside their unbroken pieces, in their unit, and how many seconds those pieces last."""
    length = duration = 0.0
    for piece in runs(np.asarray(is_finite(points)), time_s, seams):
        length += float(np.linalg.norm(np.diff(points[piece], axis=0), axis=-1).sum())
        duration += float(time_s[piece][-1] - time_s[piece][0])
    return length, duration


def _rests(filtered: PoseSequence, rectified: Rectified) -> bool:
    """Whether an estimated path of the pelvis moves less than its frames err by themselves."""
    root, covariance, shared = filtered.root, filtered.root_covariance, filtered.root_shared
    if root is None or covariance is None or shared is None:
        return False
    own = np.einsum("tii->t", own_covariance(root, covariance, rectified.R_source_from_level[2], *shared))
    known = np.isfinite(root).all(axis=1) & np.isfinite(own)
    if not known.any():
        return False
    moved = ((root[known] - root[known].mean(axis=0)) ** 2).sum(axis=1)
    return bool(np.median(own[known]) > moved.mean())
