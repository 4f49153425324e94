"""Several people before one static camera have one gravity: what each of them says about it is pooled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...pipeline.core.camera import Look
from .evidence import Evidence, about, fuse
from .fusion import fused_up
from .levelling import Levelled, level, static_up, why_not
from .person import PersonFrames


def level_people(
    people: Sequence[PersonFrames], told: Sequence[Evidence] = (), look: Look | None = None
) -> list[Levelled]:
    """One up for all, and the camera's heading, so that who faces whom can be read off: one R_camera_from_level (3, 3).

    Each person's up counts by 1 / error^2; who could not be levelled alone (lies, is hardly seen) has no say and takes
    the others' up. Lifted by the same network, people may lean alike: the pooled error is stated as no less than the
    best person's own. told: what the user tells; look: what the image says. Where nobody can be levelled alone and
    nothing else is told, everybody keeps an up of their own, and the reason why it is none. People of one name are
    numbered in the shares, in the order given."""
    alone = [level(person, static_up(person)) for person in people]
    # The alone have shares of frames, feet or floor, so that nothing is taken on trust.
    heard = [not why_not(levelled) for levelled in alone]
    if not any(heard) and not told and look is None:
        return alone
    names = _numbered([person.name for person in people])
    own = {name: levelled.up for name, levelled, use in zip(names, alone, heard, strict=True) if use}

    def said(wider: float) -> list[Evidence]:
        return [
            about(name, up.up, wider**2 * up.covariance)
            for name, up in own.items()
            if up.covariance is not None
        ]

    errors = {name: float(up.error_deg) for name, up in own.items()}
    wider = max(1.0, min(errors.values()) / float(fuse(said(1.0)).error_deg)) if own else 1.0
    fused = fused_up(said(wider), told, look)
    shared = replace(fused, own=fused.own | {name: (up.up, errors[name]) for name, up in own.items()})
    return [level(person, shared) for person in people]


def _numbered(names: Sequence[str]) -> list[str]:
    """The names, those that are not the only ones with a number behind them."""
    return [
        f"{name} ({names[: row + 1].count(name)})" if names.count(name) > 1 else name
        for row, name in enumerate(names)
    ]
