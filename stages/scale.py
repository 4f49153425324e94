"""Metres for skeletons of lifters whose unit is unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import PoseSequence, moved_covariance
from ..pipeline.core.take import Take, Told


@dataclass(frozen=True)
class Scale:
    """The stage. Metres by the stature that the user gives (`take.told`), else the source's unit stays. A notice says
    if it has no scale, or if the scale is a network's, which cannot see a person's height."""

    name: ClassVar[str] = "scale"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    renews: ClassVar[tuple[str, ...]] = ("rectified",)
    reads: ClassVar[tuple[str, ...]] = ("stature_m",)

    def unit_of(self, before: str, told: Told) -> str:
        """Metres if the user gives a stature."""
        return before if told.stature_m is None else "m"

    def __call__(self, take: Take) -> Take:
        stature_m, poses, rectified = take.told.stature_m, take.need("poses"), take.rectified
        if stature_m is not None:
            scaled, factor = scale(poses, stature_m)
            if rectified is not None:
                level = _times(rectified.level, factor, stature_m)
                rectified = replace(rectified, level=level, source=scaled.frame)
            return take.with_(poses=scaled, rectified=rectified)
        if poses.frame.metric:
            assumed = poses.made_by.kind == "estimated" and poses.frame.family == "camera"
            lengths = (
                "Lengths are in metres for the body size that the estimator assumes, which no image shows"
            )
            return take.saying(notice("no-scale", weight="warning", lengths=lengths)) if assumed else take
        return take.saying(notice("no-scale", lengths="Lengths have no unit"))


def scale(poses: PoseSequence, stature_m: float) -> tuple[PoseSequence, float]:
    """The same skeleton in metres, and the factor: one for the take, from the median lengths of its limb bones.

    The limb bones of a person of that stature come from the table of segment proportions in
    pipeline/core/anthropometry.py. Raises InputError when no limb is seen.
    """
    implied = implied_stature(poses.joints)
    if not implied > 0:
        raise InputError(
            "nothing-usable", "No limb bone is ever complete, so the stature cannot set the scale."
        )
    factor = float(stature_m / implied)
    return _times(poses, factor, stature_m), factor


def _times(poses: PoseSequence, factor: float, stature_m: float) -> PoseSequence:
    times = factor * np.eye(3)
    return poses.with_(
        joints=poses.joints * factor,
        path=poses.path and poses.path.moved(times),
        covariance=moved_covariance(poses.covariance, times),
        frame=poses.frame.with_(unit="m"),
    ).noted("scale", stature_m=stature_m, factor=factor)
