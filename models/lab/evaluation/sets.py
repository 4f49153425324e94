"""Whom evaluations judge, and before what cameras."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.reading.mocap.clip import Clip
from ..mocap.clips import Subjects, data_set, read_clips
from .testbed import BEDS, MIN_FRAMES, Bed, LiftedTake, lifted_takes

Sets = Literal["test", "val", "tennis"]


@dataclass(frozen=True)
class EvaluationSet:
    """label: its name in tables. subjects: whose clips; of: those of that data set only (clips.data_set). bed: the
    cameras that see them."""

    label: str
    subjects: Subjects
    bed: Bed = "wild"
    of: str | None = None

    def clips(self) -> tuple[Clip, ...]:
        """The motion capture of the set; InputError where the data is not, or no take of it is long enough."""
        clips = tuple(clip for clip in read_clips(self.subjects) if self._has(clip))
        if not any(len(clip) >= MIN_FRAMES for clip in clips):
            raise InputError(
                f"Expected a take of {MIN_FRAMES} frames or more for the set {self.label}, but the motion capture has "
                "none; set PCNET3D_DATA to a folder that has one."
            )
        return clips

    def long_clips(self) -> tuple[Clip, ...]:
        """Those that are long enough for a take."""
        return tuple(clip for clip in self.clips() if len(clip) >= MIN_FRAMES)

    def takes(
        self, seed: int, lifter: str | Path = "pcnet3d", flip: bool = False, focal_known: bool = False
    ) -> Iterator[LiftedTake]:
        """The set's lifted takes (testbed.lifted_takes)."""
        return lifted_takes(
            self.subjects,
            seed,
            model=lifter,
            flip=flip,
            focal_known=focal_known,
            views=BEDS[self.bed],
            only=self._has,
        )

    def _has(self, clip: Clip) -> bool:
        return self.of is None or data_set(clip) == self.of


def evaluation_sets(sets: Sets = "val", bed: Bed = "wild") -> tuple[EvaluationSet, ...]:
    """Sets of people whom no network was taught by: "test", those that figures are published of, and "tennis", others
    at match pace; "val", those that networks and constants are chosen by."""
    if sets == "tennis":
        return (EvaluationSet("Tennis test", "tennis", bed),)
    if sets == "test":
        return EvaluationSet("CMU test", "test", bed), EvaluationSet("HDM05", "hdm05", bed)
    return (
        EvaluationSet("CMU val", "val", bed, of="cmu"),
        EvaluationSet("ACCAD m1", "val", bed, of="accad"),
        EvaluationSet("Tennis val", "val", bed, of="tennis"),
    )


def heading(
    lifter: str | Path, seed: int | None, flip: bool, sets: Sequence[EvaluationSet] = ()
) -> dict[str, Any]:
    """What reports say first: versions and settings; the seed and the cameras of those that have them."""
    found = {"pcnet3d": package_version(), "lifter": str(lifter), "flip": flip}
    return found | ({} if seed is None else {"seed": seed}) | ({"bed": sets[0].bed} if sets else {})
