"""Several people before one static camera have one gravity: what each of them says about it is pooled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...pipeline.camera import Look
from ...pipeline.rotations import angle_deg
from .fusion import alone, decide
from .levelling import Levelled, level_static, static_up, why_not
from .votes import RAYLEIGH_90, Evidence, TakeUp, direction

_APART_DEG = 12.0  # a person's own up this far from the common one, and further than
_APART_ERRORS = 3.0  # this many of its expected errors, is said


@dataclass(frozen=True, eq=False)
class Seen:
    """One person as a rectifier sees them: arguments of levelling.level_static, and how the shares name them."""

    name: str
    joints: np.ndarray
    R_camera_from_body: np.ndarray
    error_deg: np.ndarray
    time_s: np.ndarray
    seams: tuple[int, ...] = ()
    root: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Together:
    """levelled: of each person, with one R_camera_from_level (3, 3) for all that have a rotation. apart_deg: how far
    each one's own up is from the common one where that is more than their errors explain, else NaN."""

    levelled: tuple[Levelled, ...]
    apart_deg: tuple[float, ...]


def level_people(people: Sequence[Seen], told: Sequence[Evidence] = (), look: Look | None = None) -> Together:
    """One up for all, and the camera's heading, so that who faces whom can be read off.

    Each person's up counts by 1 / error^2; who could not be levelled alone (lies, is hardly seen) has no say and takes
    the others' up. Lifted by the same network, people may lean alike: the pooled error is stated as no less than the
    best person's own. told: what the user tells; look: what the image says. Where nobody can be levelled alone and
    nothing else is told, everybody keeps an up of their own, and the reason why it is none."""
    ups = [
        static_up(one.joints, one.R_camera_from_body, one.error_deg, one.time_s, (), one.root)[0]
        for one in people
    ]
    alone_ = [_level(one, up) for one, up in zip(people, ups, strict=True)]
    # The alone have shares of "frames", "feet" or "floor", so that nothing is taken on trust.
    trusted = [i for i, levelled in enumerate(alone_) if not why_not(levelled, people[i].joints)]
    if not trusted and not told and look is None:
        return Together(tuple(alone_), (float("nan"),) * len(people))
    shared, warnings = _pooled([people[i].name for i in trusted], [ups[i] for i in trusted], told, look)
    return Together(
        tuple(replace(_level(one, shared), warnings=warnings) for one in people),
        tuple(_apart(up, shared) if i in trusted else float("nan") for i, up in enumerate(ups)),
    )


def _level(one: Seen, up: TakeUp) -> Levelled:
    return level_static(one.joints, one.R_camera_from_body, one.error_deg, one.time_s, one.seams, shared=up)


def _pooled(
    names: Sequence[str], ups: Sequence[TakeUp], told: Sequence[Evidence], look: Look | None
) -> tuple[TakeUp, tuple[str, ...]]:
    pooled = None
    if ups:
        pooled = alone([direction(name, up.up, up.error_deg) for name, up in zip(names, ups, strict=True)])
        error_deg = max(pooled.error_deg, min(up.error_deg for up in ups))
        pooled = replace(pooled, error_deg=error_deg, bound_deg=RAYLEIGH_90 * error_deg)
    decision = decide(pooled, look, told)
    if pooled is None or not decision.bodies:
        return alone(decision.others), decision.warnings
    if not decision.others:
        return pooled, decision.warnings
    fused = alone([direction("people", pooled.up, pooled.error_deg), *decision.others])
    theirs = fused.shares["people"]
    each = {name: theirs * share for name, share in pooled.shares.items()}
    others = {one.name: fused.shares[one.name] for one in decision.others}
    return replace(fused, shares=each | others), decision.warnings


def _apart(own: TakeUp, shared: TakeUp) -> float:
    apart = float(angle_deg(own.up, shared.up))
    return apart if apart > max(_APART_DEG, _APART_ERRORS * own.error_deg) else float("nan")
