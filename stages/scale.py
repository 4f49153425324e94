"""Metres for skeletons of lifters whose unit is unknown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ..models.place.airborne import Airborne, airborne, units_a_metre
from ..models.place.flights import PEOPLE_M
from ..pipeline.core.anthropometry import implied_stature
from ..pipeline.core.errors import InputError
from ..pipeline.core.frames import scaled_covariance
from ..pipeline.core.measures import half_bar
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import PoseSequence
from ..pipeline.core.take import Take, Told

_MOST_SD = 0.07  # share of a scale by flights


@dataclass(frozen=True)
class Scale:
    """The stage. Metres by the stature that the user gives (`take.told`). Without one, metres by how fast the body
    falls in flights, if the take is rectified, the camera is known to stand still and the scale is sure to 7 %.
    Otherwise the source's unit stays. A notice says if it has no scale, or if the scale is a network's, which cannot
    see a person's height."""

    name: ClassVar[str] = "scale"
    needs: ClassVar[tuple[str, ...]] = ("poses",)
    gives: ClassVar[tuple[str, ...]] = ("poses",)
    renews: ClassVar[tuple[str, ...]] = ("rectified",)
    reads: ClassVar[tuple[str, ...]] = ("stature_m",)

    def unit_of(self, before: str, told: Told) -> str:
        """Metres if the user gives a stature. Whether flights will give metres is not known before the run."""
        return before if told.stature_m is None else "m"

    def __call__(self, take: Take) -> Take:
        stature_m = take.told.stature_m
        if stature_m is not None:
            return _scaled(take, stature_m)[0]
        poses = take.need("poses")
        if poses.frame.metric:
            assumed = poses.made_by.kind == "estimated" and poses.frame.family == "camera"
            return take.saying(notice("scale-assumed")) if assumed else take
        flown = Airborne() if take.rectified is None else airborne(take)
        if take.rectified is None or not (flown.judged and flown.still):
            return take.saying(notice("no-scale"))
        units, sd = units_a_metre(take.rectified.level, flown.flights)
        stature_m = implied_stature(take.rectified.level.joints) / units
        if not (sd <= _MOST_SD and PEOPLE_M[0] < stature_m < PEOPLE_M[1]):
            return take.saying(notice("no-scale"))
        scaled, factor = _scaled(take, stature_m, sd)
        said: dict[str, Any] = {"flights": len(flown.flights), "factor": factor, "stature_m": stature_m}
        return scaled.saying(
            notice("scaled-by-flights", **said, within_m=half_bar(sd * stature_m), percent=half_bar(100 * sd))
        )


def _scaled(take: Take, stature_m: float, sd: float | None = None) -> tuple[Take, float]:
    """The take's poses, also those that were rectified, in metres, and the factor."""
    poses, factor = scale(take.need("poses"), stature_m, sd)
    rectified = take.rectified
    if rectified is not None:
        level = _times(rectified.level, factor, stature_m, sd)
        rectified = replace(rectified, level=level, source=poses.frame)
    return take.with_(poses=poses, rectified=rectified), factor


def scale(poses: PoseSequence, stature_m: float, sd: float | None = None) -> tuple[PoseSequence, float]:
    """The same skeleton in metres, and the factor: one for the take, from the median lengths of its limb bones.

    The limb bones of a person of that stature come from the table of segment proportions in
    pipeline/core/anthropometry.py. sd: standard deviation of the scale, as a share, if flights give it; otherwise that
    of a stature that the user gives. Raises InputError when no limb is seen.
    """
    implied = implied_stature(poses.joints)
    if not implied > 0:
        raise InputError(
            "nothing-usable", "No limb bone is ever complete, so the stature cannot set the scale."
        )
    factor = float(stature_m / implied)
    return _times(poses, factor, stature_m, sd), factor


def _times(poses: PoseSequence, factor: float, stature_m: float, sd: float | None) -> PoseSequence:
    covariance, shared = scaled_covariance(poses.root_covariance, factor), poses.root_shared
    root = None if poses.root is None else poses.root * factor
    if sd is not None and root is not None and covariance is not None and shared is not None:
        covariance = covariance + (sd**2 - shared[0] ** 2) * root[:, :, None] * root[:, None, :]
        shared = (round(sd, 3), shared[1])
    by = {} if sd is None else {"by": "flights", "sd": round(sd, 3)}
    return poses.mapped(
        lambda points: points * factor,
        root=root,
        root_covariance=covariance,
        root_shared=shared,
        covariance=scaled_covariance(poses.covariance, factor),
        frame=poses.frame.with_(unit="m"),
    ).noted("scale", stature_m=stature_m, factor=factor, **by)
