"""Metres for skeletons of lifters whose unit is unknown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import scaled_covariance
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.take import Take, Told


@dataclass(frozen=True)
class Scale:
    """The stage. Metres by the person's stature that the user tells (`take.told`); without one the source's unit is
    kept, and said when it has no scale."""

    name: ClassVar[str] = "scale"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    reads: ClassVar[tuple[str, ...]] = ("stature_m",)

    def unit_of(self, before: str, told: Told) -> str:
        """Metres where a stature is told."""
        return before if told.stature_m is None else "m"

    def __call__(self, take: Take) -> Take:
        poses, stature_m = take.need("poses"), take.told.stature_m
        if stature_m is None:
            if poses.frame.metric:
                return take
            return take.saying(notice("no-scale"))
        poses, factor = scale(poses, stature_m)
        return take.with_(poses=poses).saying(notice("scaled", factor=factor, stature_m=stature_m))


def scale(poses: PoseSequence, stature_m: float) -> tuple[PoseSequence, float]:
    """The same skeleton in metres, and the factor that made it so: one for the take, from its limb bones' median
    lengths.

    The limb bones of a person of that stature are taken from the table of segment proportions in
    pipeline/core/anthropometry.py. Raises InputError for a stature that no person has or when no limb is seen.
    """
    if not 0.4 < stature_m < 2.6:
        raise InputError("bad-value", f"Expected a stature in metres, got {stature_m}.")
    implied = implied_stature(poses.joints)
    if not implied > 0:
        raise InputError(
            "nothing-usable", "No limb bone is ever complete, so the stature cannot set the scale."
        )
    factor = float(stature_m / implied)
    metric = poses.mapped(
        lambda points: points * factor,
        root=None if poses.root is None else poses.root * factor,
        root_covariance=scaled_covariance(poses.root_covariance, factor),
        covariance=scaled_covariance(poses.covariance, factor),
        frame=poses.frame.with_(unit="m"),
    ).noted("scale", stature_m=stature_m, factor=factor)
    return metric, factor
