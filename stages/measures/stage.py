"""Figures of a take: ranges of motion, symmetry, repetitions, walking, jumps and paths, each with its error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...models.common.motion import Motion, motion_of
from ...models.gait.errors import own_covariance
from ...models.gait.gait import Gait
from ...models.gait.take_walks import Walk, gait_of, walks_of
from ...models.place.flights import Airborne, Flight, airborne
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import Measure, Row, side_of, withheld, within
from ...pipeline.core.measures import Measures as Rows
from ...pipeline.core.notices import notice, verdict
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.signals.filters import runs
from ...pipeline.signals.foot_angles import ALL_ANGLES
from ...pipeline.signals.norms import cannot_be_told
from .counted import counted_rows
from .figures import basis
from .jumps import jumping, jumps, landings, without_leaps
from .movements import MOVEMENTS, Counted, count, repeated
from .off_keypoints import exchanged, off_keypoints
from .ranges import range_rows, ranges, sides_withheld, symmetry_rows
from .walking import doubts, walking


@dataclass(frozen=True)
class Measures:
    """The stage. repeat: further angles whose repetitions are counted, such as "r_elbow_flexion". belt_speed: of a
    treadmill, in the take's unit of length a second (m/s); where it is not told, the feet that stand tell it, if the
    pelvis path is known. unusable: whether figures are made of poses that are unusable too."""

    repeat: tuple[str, ...] = ()
    belt_speed: float | None = None
    unusable: bool = False

    name: ClassVar[str] = "measures"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "filtered", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ("measures",)

    def __post_init__(self) -> None:
        for name in self.repeat:
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
        if not self.unusable and verdict(take.judged) == "unusable":
            return take.with_(measures=Rows()).saying(notice("figures-withheld"))
        motion, compared = motion_of(take), sides_withheld(take)
        detections, angles = detected(take, motion, self.repeat), ranges(motion)
        rows = (
            *within("range_of_motion", range_rows(motion, angles)),
            *within("symmetry", symmetry_rows(motion, angles, compared)),
            *counted_rows(motion, detections.counted),
            *within(
                "walking",
                walking(motion, detections.gait, detections.walks, self.belt_speed, compared.get("leg", "")),
            ),
            *within("jumps", jumps(motion, detections.airborne, detections.jumps)),
            *within("paths", _paths(motion)),
            *within("off_keypoints", off_keypoints(motion)),
        )
        notices = exchanged(take, motion) + doubts(motion, detections.gait)
        on_belt = any(row.name == "belt" for row in rows) and self.belt_speed is None
        once = dict.fromkeys(rows)  # figures may share a reason
        return take.with_(measures=Rows(tuple(once))).saying(*notices, *[notice("on-a-belt")] * on_belt)


@dataclass(frozen=True, eq=False)
class Detections:
    """What was found in a take, each with its seconds. walks: of the gait; jumps: of the flights of `airborne`;
    counted: repetitions, by movement."""

    gait: Gait
    walks: tuple[Walk, ...]
    airborne: Airborne
    jumps: tuple[Flight, ...]
    counted: tuple[Counted, ...]


def detected(take: Take, motion: Motion, repeat: Sequence[str] = ()) -> Detections:
    """All that is looked for. motion: the take's; repeat: further angles whose repetitions are counted."""
    flown, gait = airborne(take), gait_of(motion)
    jumped = jumping(motion, flown, gait)
    gait = without_leaps(gait, jumped)
    walks = walks_of(motion, gait)
    busy = [*((step.start_s, step.stop_s) for walk in walks for step in walk.every), *landings(flown)]
    movements = (*MOVEMENTS, *map(repeated, repeat))
    counted = tuple(count(motion, movement, busy, flown.ankle) for movement in movements)
    return Detections(gait, tuple(walks), flown, tuple(jumped), counted)


def _paths(motion: Motion) -> list[Row]:
    """Lengths and mean speeds; none of a joint whose error is larger than its motion, which is then the error's, nor
    before a camera that moves, whose turning about the vertical would add to the path."""
    if motion.moving_camera:
        return [withheld("camera-moves")]
    result: list[Row] = []
    for column in motion.columns:
        joint = column.removesuffix("_x")
        axes = [f"{joint}_{axis}" for axis in "xyz"]
        if joint == column or not set(axes) <= set(motion.columns):
            continue
        points = np.stack([motion.columns[axis] for axis in axes], axis=-1)
        length, duration = path_length(points, motion.times, motion.seams)
        rests_on = basis(points.sum(axis=-1))
        if duration == 0:
            result += within(joint, [withheld("few-frames"), *rests_on], side_of(joint))
            continue
        if cannot_be_told(motion.columns, f"{joint}_speed") or (joint == "root" and _rests(motion)):
            result += within(joint, [withheld("error-too-large"), *rests_on], side_of(joint))
            continue
        length_rows = [
            Measure("path_length", float(length)),
            Measure("mean_speed", float(length / duration)),
            Measure("duration", float(duration)),
        ]
        result += within(joint, [*length_rows, *rests_on], side_of(joint))
    return result or [withheld("no-paths")]


def path_length(points: np.ndarray, time_s: np.ndarray, seams: Sequence[int] = ()) -> tuple[float, float]:
    """How far points (T, D) go inside their unbroken pieces, in their unit, and how many seconds those pieces last."""
    length = duration = 0.0
    for piece in runs(np.asarray(is_finite(points)), time_s, seams):
        length += float(np.linalg.norm(np.diff(points[piece], axis=0), axis=-1).sum())
        duration += float(time_s[piece][-1] - time_s[piece][0])
    return length, duration


def _rests(motion: Motion) -> bool:
    """Whether an estimated path of the pelvis moves less than its frames err by themselves."""
    path = motion.filtered.path
    if path is None or path.covariance is None or path.shared is None:
        return False
    root, axis = path.points, motion.rectified.R_source_from_level[2]
    own_variance = np.einsum("tii->t", own_covariance(root, path.covariance, axis, *path.shared))
    has_error = np.isfinite(root).all(axis=1) & np.isfinite(own_variance)
    if not has_error.any():
        return False
    moved = ((root[has_error] - root[has_error].mean(axis=0)) ** 2).sum(axis=1)
    return bool(np.median(own_variance[has_error]) > moved.mean())
