"""Figures of a take: ranges of motion, symmetry, repetitions, walking and jumps, each with its error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...models.common.motion import Motion, motion_of
from ...models.gait.gait import gait_of, walks_of
from ...models.place.flights import airborne
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import Measures as Rows
from ...pipeline.core.measures import Row, side_of, within
from ...pipeline.core.notices import notice, verdict
from ...pipeline.core.take import Take
from ...pipeline.plugins.options import did_you_mean
from ...pipeline.signals.angles import ALL_ANGLES
from ...pipeline.signals.filters import stretches
from .figures import moments
from .jumps import jumping, jumps, landings, without_leaps
from .movements import MOVEMENTS, count, counted_rows, repeated
from .ranges import range_rows, ranges, sides_withheld, symmetry_rows
from .walking import doubts, focal_doubts, walking


@dataclass(frozen=True)
class Measures:
    """The stage. repeat: further angles whose repetitions are counted, such as "r_elbow_flexion". unusable:
    whether figures are made of poses that are unusable too."""

    repeat: tuple[str, ...] = ()
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

    def __call__(self, take: Take) -> Take:
        if not self.unusable and verdict(take.judged) == "unusable":
            return take.with_(measures=Rows()).saying(notice("figures-withheld"))
        motion, compared = motion_of(take), sides_withheld(take)
        angles, flown, gait = ranges(motion), airborne(take), gait_of(motion)
        jumped = jumping(motion, flown, gait)
        gait = without_leaps(gait, jumped)
        walks = walks_of(motion, gait)
        busy = [*((step.start_s, step.stop_s) for walk in walks for step in walk.every), *landings(flown)]
        movements = (*MOVEMENTS, *map(repeated, self.repeat))
        counted = [count(motion, movement, busy, flown.ankle) for movement in movements]
        rows = (
            *within("range_of_motion", range_rows(angles)),
            *within("symmetry", symmetry_rows(motion, angles, compared)),
            *counted_rows(motion, counted),
            *within("walking", walking(motion, gait, walks, compared.get("leg", ""))),
            *within("jumps", jumps(motion, flown, jumped)),
            *within("off_keypoints", _off_keypoints(motion)),
        )
        notices = doubts(motion, gait) + focal_doubts(motion, gait, take.camera)
        on_belt = any(row.name == "belt_speed" for row in rows)
        once = dict.fromkeys(rows)  # figures may share a reason
        return take.with_(measures=Rows(tuple(once))).saying(*notices, *[notice("on-a-belt")] * on_belt)


def _off_keypoints(motion: Motion) -> list[Row]:
    """From when to when a limb contradicts its keypoints; empty without keypoints beside poses in a camera's axes."""
    rows: list[Row] = []
    for limb, off in motion.against.items():
        if len(spans := stretches(off)):
            first_s, last_s = motion.times[np.subtract(spans, (0, 1))].T
            rows += within(limb, [moments("start", first_s), moments("stop", last_s)], side_of(limb))
    return rows
