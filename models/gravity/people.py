"""Several people before one static camera have one gravity: what each of them says about it is pooled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...pipeline.camera import Look
from ...pipeline.rotations import angle_deg
from .evidence import Evidence, TakeUp, direction, fuse
from .fusion import fused_up
from .levelling import Levelled, level, static_up, why_not
from .seen import Seen

_APART_DEG = 12.0  # a person's own up this far from the common one, and further than
_APART_ERRORS = 3.0  # this many of its expected errors, is said
_PEOPLE = "people"


def level_people(
    people: Sequence[Seen], told: Sequence[Evidence] = (), look: Look | None = None
) -> list[Levelled]:
    """One up for all, and the camera's heading, so that who faces whom can be read off: one R_camera_from_level (3, 3).

    Each person's up counts by 1 / error^2; who could not be levelled alone (lies, is hardly seen) has no say and takes
    the others' up. Lifted by the same network, people may lean alike: the pooled error is stated as no less than the
    best person's own. told: what the user tells; look: what the image says. Where nobody can be levelled alone and
    nothing else is told, everybody keeps an up of their own, and the reason why it is none."""
    alone = [level(one, static_up(one)) for one in people]
    # The alone have shares of frames, feet or floor, so that nothing is taken on trust.
    heard = [not why_not(levelled) for levelled in alone]
    if not any(heard) and not told and look is None:
        return alone
    own = [(one.name, levelled.up) for one, levelled, use in zip(people, alone, heard, strict=True) if use]
    shared = _shared(own, told, look)
    return [
        replace(level(one, shared), apart_deg=_apart_deg(levelled.up, shared) if use else float("nan"))
        for one, levelled, use in zip(people, alone, heard, strict=True)
    ]


def _shared(own: Sequence[tuple[str, TakeUp]], told: Sequence[Evidence], look: Look | None) -> TakeUp:
    """own: each person's name and up."""
    if not own:
        return fused_up((), told, look)
    pooled = fuse([direction(name, up.up, float(up.error_deg)) for name, up in own])
    error_deg = float(max(pooled.error_deg, min(up.error_deg for _, up in own)))
    pooled = replace(pooled, error_deg=error_deg)
    found = fused_up([direction(_PEOPLE, pooled.up, error_deg)], told, look)
    theirs = found.shares.get(_PEOPLE, 0.0)
    if theirs == 1:  # nobody else is heard
        return replace(pooled, warnings=found.warnings)
    each = {name: theirs * share for name, share in pooled.shares.items() if theirs}
    return replace(found, shares=each | {name: s for name, s in found.shares.items() if name != _PEOPLE})


def _apart_deg(own: TakeUp, shared: TakeUp) -> float:
    apart = float(angle_deg(own.up, shared.up))
    return apart if apart > max(_APART_DEG, _APART_ERRORS * own.error_deg) else float("nan")
