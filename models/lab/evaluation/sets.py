"""What a report is asked: whom it judges, before what cameras, lifted by what."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import PoseSequence, package_version
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.mocap import Clip
from ....pipeline.running.progress import each
from ...lifter.builtin import lift
from ..mocap.clips import Subjects, data_set, read_clips
from ..synthetic.cameras import ViewRange
from .testbed import BEDS, MIN_FRAMES, Bed, LiftedTake, SeenTake, lifted_takes

Sets = Literal["test", "val", "tennis"]


@dataclass(frozen=True)
class EvaluationSet:
    """label: its name in tables. subjects: whose clips; of: those of that data set only (clips.data_set)."""

    label: str
    subjects: Subjects
    of: str | None = None

    def clips(self) -> tuple[Clip, ...]:
        """The motion capture of the set; InputError where the data is not, or no take of it is long enough."""
        clips = tuple(clip for clip in read_clips(self.subjects) if self.has(clip))
        if not any(len(clip) >= MIN_FRAMES for clip in clips):
            raise InputError(
                "nothing-usable",
                f"Expected a take of {MIN_FRAMES} frames or more for the set {self.label}, but the motion capture has "
                "none; set PCNET3D_DATA to a folder that has one.",
            )
        return clips

    def has(self, clip: Clip) -> bool:
        return self.of is None or data_set(clip) == self.of


def evaluation_sets(sets: Sets = "val") -> tuple[EvaluationSet, ...]:
    """Sets of people whom no network was taught by: "test", those that figures are published of, and "tennis", others
    at match pace; "val", those that networks and constants are chosen by."""
    if sets == "tennis":
        return (EvaluationSet("Tennis test", "tennis"),)
    if sets == "test":
        return EvaluationSet("CMU test", "test"), EvaluationSet("HDM05", "hdm05")
    return (
        EvaluationSet("CMU val", "val", of="cmu"),
        EvaluationSet("ACCAD m1", "val", of="accad"),
        EvaluationSet("Tennis val", "val", of="tennis"),
    )


@dataclass(frozen=True)
class Question:
    """What every report is asked. rectifiers: those that are judged. lifter: what lifts (lifter.builtin.lift).
    seed: of cameras and detectors. people: whose takes, before the cameras of `bed`; None for a report on other data.
    """

    rectifiers: tuple[Rectifier, ...] = ()
    lifter: str | Path = "pcnet3d"
    seed: int = 0
    people: Sets | None = "val"
    bed: Bed = "wild"

    @property
    def sets(self) -> tuple[EvaluationSet, ...]:
        return evaluation_sets(self.people) if self.people else ()

    @property
    def views(self) -> ViewRange:
        return BEDS[self.bed]

    def takes(self, of: EvaluationSet, focal_known: bool = False) -> Iterator[LiftedTake]:
        """The set's lifted takes (testbed.lifted_takes), counted on the screen."""
        takes = lifted_takes(
            of.subjects, self.seed, model=self.lifter, focal_known=focal_known, views=self.views, only=of.has
        )
        yield from each(takes, f"{of.label} takes", len(of.clips()))

    def lift(
        self,
        keypoints: PoseSequence,
        image_size: tuple[int, int],
        focal_px: float | None = None,
        up: np.ndarray | None = None,
    ) -> PoseSequence:
        """lifter.builtin.lift by the lifter that is judged."""
        return lift(keypoints, image_size, focal_px, model=self.lifter, up=up)

    def lift_seen(
        self, seen: SeenTake, focal_px: float | None = None, up: np.ndarray | None = None
    ) -> PoseSequence:
        """The lift of a take of the test bed."""
        return self.lift(seen.keypoints, seen.image_size, focal_px, up)

    def heading(self) -> dict[str, Any]:
        """What reports say first: versions and settings; the seed and the cameras of those that have them."""
        said = {"pcnet3d": package_version(), "lifter": str(self.lifter)}
        return said | ({"seed": self.seed, "bed": self.bed} if self.people else {})
